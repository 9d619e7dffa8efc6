"""The figures of the reproduction, in the order of the paper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from fringeforce.contacts.loads import PAPER_ANGLE, PAPER_LOAD
from fringeforce.mechanics.mesh import paper_mesh, strip_mesh
from fringeforce.optics.photoelasticity import phase_lead
from fringeforce.plotting import axes as plot
from fringeforce.reading.reader import Reader
from fringeforce.reproduction.dynamic_range import draw_dynamic_range
from fringeforce.reproduction.example import CASES, DEPTHS, PaperExample, rectangle_rule
from fringeforce.reproduction.recovery import PAPER_ANGLES, PAPER_MAGNITUDES
from fringeforce.studies.convergence import mesh_errors


def _draw_overview(example: PaperExample, ax: Axes) -> None:
    sensor, model = example.sensor, example.models["free"]
    x = sensor.pixel_positions
    ax.axis("off")
    rows = ((0, 0.62, 1, 0.38), (0, 0.28, 1, 0.3), (0, 0, 1, 0.2))
    loaded, curve, light = (ax.inset_axes(row) for row in rows)
    plot.strip(loaded, sensor.transducer, sensor.tactels.positions, example.forces)
    plot.curves(curve, x, {"": model.phase(example.forces)}, "phase [rad]")
    curve.set(xlabel="", xticklabels=[])
    wavelength = sensor.polariscope.wavelength
    plot.fringes(light, x, model.intensity(example.forces), sensor.transducer.width, wavelength)


def _draw_mesh(example: PaperExample, ax: Axes) -> None:
    strip, tactels = example.sensor.transducer, example.sensor.tactels.positions
    plot.mesh(ax, strip_mesh(strip, tactels), -strip.compliant.thickness, tactels)


def _draw_paper_mesh(example: PaperExample, ax: Axes) -> None:
    strip, tactels = example.sensor.transducer, example.sensor.tactels.positions
    plot.mesh(ax, paper_mesh(strip, tactels), -strip.compliant.thickness, tactels)


def _draw_stress(edges: str) -> Callable[[PaperExample, Axes], None]:
    def draw(example: PaperExample, ax: Axes) -> None:
        sigma_x = example.stresses(edges, example.x, -np.array(DEPTHS))[0]
        labels = [f"{depth * 1e3:g} mm deep" for depth in DEPTHS]
        profiles = dict(zip(labels, sigma_x.T / 1e6, strict=True))
        plot.curves(ax, example.x, profiles, r"$\sigma_x$ [MPa]")

    return draw


def _draw_phase(example: PaperExample, ax: Axes) -> None:
    plot.curves(
        ax, example.x, {CASES[edges]: example.phase(edges) for edges in CASES}, "phase lead p [rad]"
    )


def _draw_columns(example: PaperExample, ax: Axes) -> None:
    psi = example.models["free"].influence(example.x)
    columns = {
        r"$0.4\,\mathrm{N}\ \cdot\ ^N\psi_1$": 0.4 * psi[:, 0, 0],
        r"$0.2\,\mathrm{N}\ \cdot\ ^T\psi_1$": 0.2 * psi[:, 0, 1],
    }
    plot.curves(ax, example.x, columns, "phase lead [rad]")


def _draw_intensity(example: PaperExample, ax: Axes) -> None:
    model = example.models["free"]
    light = model.intensity(example.forces)
    plot.curves(ax, model.sensor.pixel_positions, {"": light}, "intensity I")


def _draw_frame(example: PaperExample, ax: Axes) -> None:
    model = example.models["free"]
    frame = model.expose(example.forces, rng=0)
    plot.curves(ax, model.sensor.pixel_positions, {"": frame}, "grey level", linewidth=0.6)


def _draw_recovery(example: PaperExample, ax: Axes) -> None:
    model = example.models["free"]
    reading = Reader(model).search(model.expose(example.forces, rng=0))
    x = model.sensor.pixel_positions
    plot.curves(ax, x, {"$P$, applied": model.phase(example.forces), "$P_r$, read": reading.phase},
                "phase lead [rad]")  # fmt: skip
    ax.lines[1].set_linestyle("--")


def _draw_forces(example: PaperExample, ax: Axes) -> None:
    """Magnitude and angle of every tactel as applied, as the paper reads them, and as we do."""
    model = example.models["free"]
    reading = Reader(model).search(model.expose(example.forces, rng=0))
    tactel = np.arange(1, len(reading.forces) + 1)
    ax.axis("off")
    rows = ax.inset_axes((0, 0.56, 1, 0.44)), ax.inset_axes((0, 0.04, 1, 0.44))
    for row, applied, printed, read, std, label in zip(
        rows,
        (PAPER_LOAD, PAPER_ANGLE),
        (PAPER_MAGNITUDES, PAPER_ANGLES),
        (reading.magnitude, reading.angle),
        (reading.magnitude_std, reading.angle_std),
        ("magnitude [N]", "angle [degrees]"),
        strict=True,
    ):
        row.axhline(applied, color="#888888", linestyle="--", linewidth=0.9, label="applied")
        row.errorbar(tactel - 0.1, read, 2 * std, fmt="o", capsize=3, label="we read, 2 deviations")
        if len(printed) == len(read):
            row.plot(tactel + 0.1, printed, "x", color="#d55e00", label="the paper reads")
        row.set(ylabel=label, xticks=tactel)
    rows[0].legend(fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), frameon=False)
    rows[1].set_xlabel("tactel")


def _draw_readings(example: PaperExample, ax: Axes) -> None:
    curves = {}
    depth = np.linspace(0, 1, 241)
    strip = example.sensor.transducer
    z = -strip.compliant.thickness - strip.photoelastic.thickness * depth
    for edges, case in CASES.items():
        tau = example.stresses(edges, example.x, z)[2]
        integral = np.trapezoid(tau, -z, axis=1)
        curves[rf"$\tau_{{xz}}$ taken for $\sigma_x$, {case}"] = phase_lead(
            integral, example.constant
        )
        curves[rf"$\sigma_x$, {case}"] = example.phase(edges)
    plot.curves(ax, example.x, curves, "phase lead [rad]")


def _draw_quadrature(example: PaperExample, ax: Axes) -> None:
    exact, rule = rectangle_rule(example)
    plot.curves(
        ax, example.x, {"consistent integral": exact, "equation (3)": rule}, "phase lead [rad]"
    )


def _draw_convergence(example: PaperExample, ax: Axes) -> None:
    labels, unknowns, errors = zip(*mesh_errors(example.models["roller"].sensor), strict=True)
    plot.convergence(ax, unknowns, errors, labels)


EQUATIONS = {
    "overview": ("1", "2"),
    "figure-7-columns": ("10",),
    "figure-8-intensity": ("11",),
    "figure-9-frame": ("13",),
    "equation-3": ("3",),
}
"""Equations of the paper that stand beside a figure."""
WIDE, LOW, TALL = (8.0, 3.6), (8.0, 2.0), (8.0, 4.6)
FIGURES = (
    ("overview", _draw_overview, TALL, "From forces to fringes",
     "1 N at 10 degrees on every tactel, a place where the strip reads a force; the phase lead "
     "that it causes, and what an eye behind the "
     "polariscope sees."),
    ("recovered-forces", _draw_forces, TALL, "Recovered forces",
     "Each tactel's force, read from one noisy frame. Good readings lie around the dashed line of "
     "the load that was applied, and bars of two standard deviations cross it for about 19 of 20. "
     "Angles are less certain than magnitudes, because the tangential force is the small one."),
    ("figure-2-mesh", _draw_mesh, LOW, "Figure 2: the mesh",
     "Elements grow away from the line loads (triangles) and from the corners where a free edge "
     "meets the base or the interface. Few elements of high order do what thousands of linear ones "
     "cannot."),
    ("figure-2-paper-mesh", _draw_paper_mesh, LOW, "Figure 2: the paper's own subdivision",
     "201 x 25 nodes, finer in the middle; available as characterize(sensor, mesh='paper')."),
    ("figure-4-stress-case-1", _draw_stress("free"), WIDE,
     "Figure 4: stress profiles, Case 1",
     "sigma_x under 1 N at 10 degrees on every tactel. It vanishes at the free edges, and the "
     "ripple of the single tactels fades with depth."),
    ("figure-5-stress-case-2", _draw_stress("roller"), WIDE,
     "Figure 5: stress profiles, Case 2", "The same load between rollers: the edges carry stress."),
    ("figure-6-phase", _draw_phase, WIDE, "Figure 6: phase lead, both cases",
     "The edges differ; the middle does not."),
    ("figure-7-columns", _draw_columns, WIDE, "Figure 7: two columns of the influence matrix",
     "Phase lead for 0.4 N normal and 0.2 N tangential on the leftmost tactel, Case 1."),
    ("figure-8-intensity", _draw_intensity, WIDE, "Figure 8: intensity, Case 1",
     "What an ideal camera would see of Figure 6: equation (11)."),
    ("section-4-range", draw_dynamic_range, WIDE, "Section IV: dynamic range",
     "Uniform loads at random angles up to 20 degrees. Equation (12) needs a border phase that it "
     "knows where to start from: free edges hold it at zero for every load, rollers let it go. The "
     "sign of a phase that starts above zero is put right by contact in both cases. A reader that "
     "starts from the influence matrix does not depend on the edges."),
    ("figure-9-frame", _draw_frame, WIDE, "Figure 9: the noisy frame, Case 1",
     "What the camera of the paper delivers: equation (13)."),
    ("figure-10-recovery", _draw_recovery, WIDE, "Figure 10: applied and recovered phase, Case 1",
     "Read from the single frame of Figure 9, with no earlier state."),
    ("readings-of-sigma-x", _draw_readings, WIDE, "Two readings of 'shear stress along x'",
     "Read literally, the paper's sigma_x would be the shear stress tau_xz. That vanishes at the "
     "edges in both cases, so it cannot be what the paper's figures show; the normal stress along "
     "x can. The literal reading is drawn for comparison only."),
    ("equation-3", _draw_quadrature, WIDE, "Equation (3) as a quadrature",
     "The sum over nodes, both ends at full weight, against the integral that is consistent with "
     "the elements, on the paper's mesh."),
    ("convergence", _draw_convergence, WIDE, "Convergence to the exact solution",
     "Relative error of the influence matrix (worst column) for roller edges, where an exact "
     "solution exists."),
)  # fmt: skip
