"""The paper's checkable statements beside what the model finds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fringeforce.contacts.loads import PAPER_ANGLE, PAPER_LOAD
from fringeforce.mechanics import fourier
from fringeforce.mechanics.mesh import paper_mesh
from fringeforce.models.strip import characterize
from fringeforce.optics.photoelasticity import phase_lead
from fringeforce.reproduction.dynamic_range import dynamic_range_statements
from fringeforce.reproduction.example import DEPTHS, PaperExample, rectangle_rule
from fringeforce.reproduction.recovery import AVERAGED, Recovery
from fringeforce.studies.convergence import relative_error

Finding = tuple[str, str, str, str]

PAPER_ANGLE_ERROR = 0.07
"""Largest relative error of an angle that Section V of the paper states."""


def statements(example: PaperExample, recovery: Recovery) -> Iterator[Finding]:
    """Where it stands, what the paper says, what we find, and why the two differ if they do."""
    yield from _stress_statements(example)
    yield from _phase_statements(example)
    yield from dynamic_range_statements(example)
    yield from _camera_statements(example)
    yield from _recovery_statements(recovery)
    yield from _accuracy_statements(example)


def _stress_statements(example: PaperExample) -> Iterator[Finding]:
    half = example.sensor.transducer.length / 2
    z = -np.array(DEPTHS)
    for edges, number, claim in (
        ("free", 4, "Case 1: the stress at the borders must be zero"),
        ("roller", 5, "Case 2: the stress at the borders need not be zero"),
    ):
        sigma_x = example.stresses(edges, np.append(example.x, [-half, half]), z)[0]
        border = np.abs(sigma_x[-2:]).max() / np.abs(sigma_x[:-2]).max()
        yield f"Fig. {number}", claim, f"border stress is {border:.2%} of the largest", ""
    pitch = example.sensor.tactels.pitch
    loaded = np.abs(example.x) < example.sensor.tactels.positions[-1]
    sigma_x = example.stresses("free", example.x, z)[0]
    window = max(round(pitch / (example.x[1] - example.x[0])), 1)
    ripples = []
    for profile in sigma_x.T:
        smooth = np.convolve(profile, np.ones(window) / window, mode="same")
        ripples.append(np.std((profile - smooth)[loaded]) / 1e3)
    found = ", ".join(
        f"{ripple:.3g} kPa at {depth * 1e3:g} mm"
        for ripple, depth in zip(ripples, DEPTHS, strict=True)
    )
    yield (
        "Fig. 4",
        "the layer is a low-pass filter: the stress is smoother with depth",
        f"ripple within one pitch: {found}",
        "",
    )


def _phase_statements(example: PaperExample) -> Iterator[Finding]:
    phases = {edges: example.phase(edges) for edges in ("free", "roller")}
    free, roller = phases["free"], phases["roller"]
    yield (
        "Fig. 6",
        "phase at the border: zero in Case 1, non-zero in Case 2",
        f"Case 1 {free[0]:+.4f} and {free[-1]:+.4f} rad; Case 2 {roller[0]:+.4f} and "
        f"{roller[-1]:+.4f} rad",
        "",
    )
    middle = np.abs(example.x) <= example.sensor.tactels.positions[-1]
    gap = np.abs(free - roller)[middle].max() / np.abs(free).max()
    yield (
        "Fig. 6",
        "the edges do not affect the phase at some distance from them",
        f"under the tactels the cases differ by up to {gap:.1%} of the peak",
        "",
    )
    short_length = 1.2 * 2 * example.sensor.tactels.positions[-1]
    if 0 < short_length < example.sensor.transducer.length:
        short = PaperExample(example.sensor.replace(**{"transducer.length": short_length}))
        short_free, short_roller = short.phase("free"), short.phase("roller")
        gap = np.abs(short_free - short_roller).min() / np.abs(short_free).max()
        whole = np.abs(short_free - short_roller).max() / np.abs(short_free).max()
        yield (
            "Sec. II",
            "in a shorter strip the edges would matter along its full length",
            f"{short_length * 1e3:g} mm long: the cases differ by {gap:.1%} to {whole:.1%} of "
            "the peak",
            "",
        )
    psi = example.models["free"].influence(example.x)
    peaks = 0.4 * np.abs(psi[:, 0, 0]).max(), 0.2 * np.abs(psi[:, 0, 1]).max()
    yield (
        "Fig. 7",
        "phase for 0.4 N normal and 0.2 N tangential on tactel 1 (peaks near 0.5 rad)",
        f"peaks {peaks[0]:.3f} and {peaks[1]:.3f} rad",
        "",
    )
    yield (
        "Sec. IV",
        "the phase may leave [-pi, 0]; Fig. 6 is an example",
        f"lowest phase {free.min():.3f} rad in Case 1, {roller.min():.3f} rad in Case 2",
        "",
    )


def _camera_statements(example: PaperExample) -> Iterator[Finding]:
    camera = example.sensor.camera
    frame = example.models["free"].expose(example.forces, rng=0)
    lowest, highest = camera.offset - camera.noise, camera.offset + camera.amplitude + camera.noise
    yield (
        "Eq. 13",
        "I_o + min(n_o) >= 0 and A + I_o + max(n_o) <= 2^B - 1",
        f"{lowest:g} and {highest:g} of {camera.full_scale}; the frame spans {frame.min()} to "
        f"{frame.max()} over {len(frame)} pixels",
        "",
    )


def _recovery_statements(recovery: Recovery) -> Iterator[Finding]:
    magnitude, angle = recovery.magnitude_error, recovery.angle_error
    tangential = PAPER_LOAD * np.sin(np.radians(PAPER_ANGLE))
    yield (
        "Sec. V",
        "from one noisy frame the magnitudes are within 6 %",
        f"largest of all tactels: {np.median(magnitude):.1%} in the median of {len(magnitude)} "
        f"frames, {np.percentile(magnitude, 95):.1%} in 95 % of them",
        "",
    )
    yield (
        "Sec. V",
        "and the angles within 7 %",
        f"largest of all tactels: {np.median(angle):.0%} in the median frame",
        ""
        if np.median(angle) <= PAPER_ANGLE_ERROR
        else "The noise of one frame alone moves a tangential force by "
        f"{recovery.bound[:, 1].mean():.3f} N or more, however it is read without bias: that is "
        f"{recovery.bound[:, 1].mean() / tangential:.0%} of the {tangential:.3f} N that act. The "
        f"mean of {AVERAGED} frames is within {recovery.averaged_angle:.1%}.",
    )


def _accuracy_statements(example: PaperExample) -> Iterator[Finding]:
    sensor = example.sensor
    mesh = paper_mesh(sensor.transducer, sensor.tactels.positions)
    yield (
        "Sec. II",
        "5,025 elements, 201 x 25 nodes",
        f"{len(mesh.x)} x {len(mesh.z)} = {len(mesh.x) * len(mesh.z):,} nodes",
        "The paper's number counts nodes, not elements, of which there are "
        f"{(len(mesh.x) - 1) * (len(mesh.z) - 1):,}.",
    )
    exact, rule = rectangle_rule(example)
    error = np.abs(rule - exact).max() / np.abs(exact).max()
    yield (
        "Eq. 3",
        "the depth integral as a sum over nodes",
        f"off by {error:.1%} of the peak on the paper's mesh",
        "The sum gives both end nodes full weight, as if the layer were thicker by one element.",
    )
    model = example.models["roller"]
    x = model.sensor.pixel_positions
    strip, tactels = model.sensor.transducer, model.sensor.tactels.positions
    oracle = phase_lead(fourier.integrated_stress(strip, tactels, x, terms=1500), example.constant)
    paper = characterize(model.sensor, mesh="paper")
    yield (
        "ours",
        "accuracy of the influence matrix (exact solution, roller edges)",
        f"{relative_error(model.influence(x), oracle):.1e} on our mesh, "
        f"{relative_error(paper.influence(x), oracle):.1e} on the paper's",
        "",
    )
