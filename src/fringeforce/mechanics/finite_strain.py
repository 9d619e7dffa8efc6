"""The strip under large strain: a total Lagrangian solution with loads on its surface.

The unknowns are the coefficients of a tensor mesh; stresses are taken at Gauss points, Newton's
method steps with a factorised tangent that is kept while it converges (Bonet and Wood,
Nonlinear Continuum Mechanics for Finite Element Analysis, 2008, chapters 8 and 9).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, gmres

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.condensed import Condensation, Tangent
from fringeforce.mechanics.deformed_light import DeformedLight
from fringeforce.mechanics.elements import gauss_line, interpolation, shape_functions
from fringeforce.mechanics.hyperelasticity import GRADIENT_STEP, Hyperelastic, PlaneResponse
from fringeforce.mechanics.mesh import GROWTH_X, Mesh, strip_mesh
from fringeforce.mechanics.surface_loads import (
    DeadLoad,
    FollowerLoad,
    Patches,
    SurfaceLoad,
    SurfacePlaces,
    TurningForces,
)
from fringeforce.mechanics.surface_stability import surface_stiffness

ORDER = 5
"""Polynomial order of the elements; one less changes the light of the paper's strip by 0.06 % of
its peak at 1 N."""
TOLERANCE = 1e-10
"""Norm of what is out of balance over that of the loads at which a step is solved."""
ENOUGH = 1e-4
"""The same for what second order leaves, a hundredth of the light of which is left by it."""
ROUNDING = 1e-12
"""What rounding leaves out of balance [N]."""
SLOW = 0.2
"""Share of the last residual above which a new tangent is factorised."""
ITERATIONS = 40
"""Newton steps within one load step."""
FOLLOWED = 1e-2
"""Share of what a step turns follower loads by that it may leave; the next one takes it up."""
KRYLOV = 60
"""Most iterations for that; 3 to 8 are usual."""
SMALLEST_STEP = 1 / 64
"""Share of the load below which steps are not cut any more."""
FEWEST = 1 / 4
"""The same of loads that a search only tries."""
SAME = 1e-11
"""Distance below which ends of patches are one, for rounding [m]."""
FOLDS = (
    "The strip is unstable under these loads: its surface folds under them. Take smaller loads or "
    "wider contacts."
)
Changes = Callable[[Array], Array]
"""Forces (k, 2, along x) on the nodes of the surface under its displacements (2, along x)."""


class SurfaceFoldError(InputError):
    """Dead loads under which short waves fold the surface; smaller steps lead there as well."""


@dataclass(frozen=True, eq=False)
class FiniteStrip:
    """A strip of hyperelastic layers with uniform tractions on patches of its surface.

    Coefficients of displacements have the shape (2, order * columns + 1, order * rows + 1): u and w
    at the shape functions of the mesh [m].

    Attributes
    ----------
    transducer : Transducer
        The strip; bonded at its base, its edges free or on rollers, plane stress or plane strain.
    centres, widths : ndarray, shape (n,)
        Middle and width of each patch in the undeformed strip [m].
    mesh : Mesh
        With a boundary of elements at each end of each patch.
    compliant, photoelastic : Hyperelastic
        Materials of the layers.

    Examples
    --------
    >>> from fringeforce.mechanics.finite_strain import finite_strip
    >>> strip = finite_strip(ff.load_sensor("saad").transducer, [0.0], [5e-4], order=3)
    >>> strip.light.integrated_stress(strip.solved([[0.1, 0.0]]), [5e-4]).round(1).tolist()
    [-6.6]
    """

    transducer: Transducer
    centres: Array
    widths: Array
    mesh: Mesh
    compliant: Hyperelastic
    photoelastic: Hyperelastic

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of the coefficients."""
        order = self.mesh.order
        return 2, order * (len(self.mesh.x) - 1) + 1, order * (len(self.mesh.z) - 1) + 1

    @cached_property
    def _rows(self) -> int:
        """Rows of elements in the photoelastic layer."""
        return int(np.searchsorted(self.mesh.z, -self.transducer.compliant.thickness * (1 + 1e-9)))

    @cached_property
    def _at_gauss(self) -> tuple[csr_array, csr_array, csr_array, csr_array]:
        mesh = self.mesh
        x, z = (gauss_line(mesh.order, breaks)[0] for breaks in (mesh.x, mesh.z))
        return *interpolation(mesh.order, mesh.x, x), *interpolation(mesh.order, mesh.z, z)

    @cached_property
    def _onto_coefficients(self) -> list[csr_array]:
        return [csr_array(matrix.T) for matrix in self._at_gauss]

    @cached_property
    def _weights(self) -> Array:
        """Reference volume of each Gauss point, shape (along x, along z) [m^3]."""
        mesh = self.mesh
        along_x, along_z = (gauss_line(mesh.order, breaks)[1] for breaks in (mesh.x, mesh.z))
        return self.transducer.width * np.multiply.outer(along_x, along_z)

    @cached_property
    def _numbers(self) -> Index:
        """Equation of every coefficient, -1 where it is held; numbered column by column."""
        _, columns, rows = self.shape
        free = np.ones((columns, 2, rows), dtype=bool)
        free[:, :, 0] = False
        if self.transducer.edges == "roller":
            free[[0, -1], 0] = False
        numbers = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
        return numbers.transpose(1, 0, 2)

    @cached_property
    def _unknowns(self) -> Condensation:
        return Condensation(self.mesh.order, self._numbers)

    @cached_property
    def _free(self) -> Index:
        """Flat places of the free coefficients, in the order of their equations."""
        flat = self._numbers.ravel()
        kept = np.flatnonzero(flat >= 0)
        return kept[np.argsort(flat[kept])]

    def gradients(self, coefficients: Array) -> Array:
        """Deformation gradient F at the Gauss points, shape (2, 2, along x, along z)."""
        vx, sx, vz, sz = self._at_gauss
        return _deformed(coefficients, (sx, vz), (vx, sz))

    def _responses(self, gradients: Array) -> tuple[PlaneResponse, PlaneResponse]:
        return self._responses_of(*np.split(gradients, [self._cut], axis=-1))

    def _responses_of(
        self, photoelastic: Array, compliant: Array
    ) -> tuple[PlaneResponse, PlaneResponse]:
        """Responses of the layers to gradients, each to its own."""
        plane = self.transducer.plane
        return (
            self.photoelastic.plane(photoelastic, plane),
            self.compliant.plane(compliant, plane),
        )

    @cached_property
    def _cut(self) -> int:
        """Gauss heights of the photoelastic layer."""
        return self._rows * (self.mesh.order + 1)

    def energy(self, coefficients: Array) -> float:
        """Strain energy of displacements [J]."""
        parts = self._responses(self.gradients(coefficients))
        density = np.concatenate([part.energy for part in parts], axis=-1)
        return float((density * self._weights).sum())

    def internal_forces(self, coefficients: Array) -> Array:
        """Derivative of the energy with respect to every coefficient, of their shape [N]."""
        return self._forces(self._responses(self.gradients(coefficients)))

    def quadratic_forces(self, coefficients: Array) -> Array:
        """Second order of `internal_forces` in displacements, of their shape [N]."""
        tilts = self.gradients(coefficients) - np.eye(2)[:, :, None, None]
        tilts = tilts.reshape(4, *self._weights.shape)
        layers = zip(self._bends, np.split(tilts, [self._cut], axis=-1), strict=True)
        stress = [(np.tensordot(bend, own, 1) * own).sum(axis=1) / 2 for bend, own in layers]
        return self._balancing(np.concatenate(stress, axis=-1).reshape(2, 2, *self._weights.shape))

    @cached_property
    def _bends(self) -> tuple[Array, Array]:
        """Derivative of the tangent without load, of the photoelastic and the other layer [Pa].

        By the entries of deformation gradients, row by row, shape (4, 4, 4).
        """
        ways = GRADIENT_STEP * np.eye(4).reshape(2, 2, 4)
        tilted = [np.eye(2)[:, :, None] + sign * ways for sign in (1, -1)]
        ahead, behind = (self._responses_of(one, one) for one in tilted)
        photoelastic, compliant = (
            (one.tangent - other.tangent).reshape(4, 4, 4) / (2 * GRADIENT_STEP)
            for one, other in zip(ahead, behind, strict=True)
        )
        return photoelastic, compliant

    def _forces(self, parts: tuple[PlaneResponse, PlaneResponse]) -> Array:
        """Internal forces of responses of both layers."""
        return self._balancing(np.concatenate([part.stress for part in parts], axis=-1))

    def _balancing(self, stress: Array) -> Array:
        """Internal forces of a first Piola-Kirchhoff stress at the Gauss points."""
        stress = stress * self._weights
        vx, sx, vz, sz = self._onto_coefficients
        return _both_ways(stress[:, 0], sx, vz) + _both_ways(stress[:, 1], vx, sz)

    def tangent(self, coefficients: Array) -> Tangent:
        """Factorise the stiffness at displacements.

        Raises
        ------
        InputError
            If the strip is unstable there.
        """
        return self._factorised(self._responses(self.gradients(coefficients)))

    def _factorised(self, parts: tuple[PlaneResponse, PlaneResponse]) -> Tangent:
        moduli = np.concatenate([part.tangent for part in parts], axis=-1) * self._weights
        mesh, order, points = self.mesh, self.mesh.order, self.mesh.order + 1
        columns, rows = len(mesh.x) - 1, len(mesh.z) - 1
        value, slope = shape_functions(order, gauss_line(order, np.array([0.0, 1.0]))[0])
        # products of two functions at the points of a line, (points, pairs), by what is derived
        pairs = {
            (one, other): np.einsum("ap,bp->pab", a, b).reshape(points, -1)
            for one, a in enumerate((slope, value))
            for other, b in enumerate((slope, value))
        }
        at = moduli.reshape(2, 2, 2, 2, columns, points, rows, points).swapaxes(5, 6)
        scale = 1 / np.diff(mesh.x)[:, None], 1 / np.diff(mesh.z)
        both = range(2)
        k = np.empty((columns * rows, 2, points, points, 2, points, points))
        along_z = np.concatenate([pairs[1 - one, 1 - other] for one in both for other in both])
        size = points * points
        summed = np.empty((columns * rows, 4, points, size))
        for i in both:
            for m in range(i + 1):
                for one in both:
                    for other in both:
                        own = at[i, one, m, other] * (scale[one] * scale[other])[..., None, None]
                        first = own.swapaxes(-1, -2).reshape(-1, points) @ pairs[one, other]
                        summed[:, 2 * one + other] = first.reshape(-1, points, size)
                part = summed.reshape(-1, 4 * points, size).transpose(0, 2, 1) @ along_z
                part = part.reshape(-1, *[points] * 4).transpose(0, 1, 3, 2, 4)
                k[:, i, :, :, m] = part
                if m < i:
                    k[:, m, :, :, i] = part.transpose(0, 3, 4, 1, 2)
        try:
            return self._unknowns.factorised(k.reshape(len(k), 2 * size, 2 * size))
        except LinAlgError:
            raise InputError(FOLDS) from None

    def surface_stiffness(self, coefficients: Array) -> Array:
        """Least stiffness of short waves at Gauss points of the surface, shape (along x,) [Pa].

        Below 0 dead loads fold it.
        """
        vx, sx, _, _ = self._at_gauss
        vz, sz = self._at_surface
        f = _deformed(coefficients, (sx, vz), (vx, sz))[..., 0]
        return surface_stiffness(self.compliant.plane(f, self.transducer.plane).tangent)

    @cached_property
    def _at_surface(self) -> tuple[csr_array, csr_array]:
        """Values and slopes along z at the surface."""
        return interpolation(self.mesh.order, self.mesh.z, self.mesh.z[-1:])

    @cached_property
    def patches(self) -> Patches:
        """Elements that each patch covers."""
        ends = self.centres + np.multiply.outer([-0.5, 0.5], self.widths)
        first, last = np.abs(self.mesh.x - ends[..., None]).argmin(axis=-1)
        return Patches(self.mesh.order, self.mesh.x, first, last)

    def load(self, forces: Array) -> SurfaceLoad:
        """Dead or follower loads of forces on the patches, shape (n, 2) [N], as the design says."""
        if self.transducer.loads == "follower":
            return FollowerLoad(self.patches, forces)
        return self.patches.dead(forces)

    def on_surface(self, nodal: Array) -> Array:
        """Nodal forces of all coefficients of those of the surface, shape (..., 2, along x) [N]."""
        found = np.zeros((*nodal.shape[:-2], *self.shape))
        found[..., -1] = nodal
        return found

    def at_rest(self, load: SurfaceLoad) -> Array:
        """Nodal forces of a load on the surface of the undeformed strip, shape (2, along x) [N]."""
        return load.nodal(np.zeros(self.shape[:2]))

    def solved(self, forces: ArrayLike) -> Array:
        """Displacements in balance with loads on the patches.

        Parameters
        ----------
        forces : array_like, shape (n, 2)
            Normal (towards -z) and tangential (towards +x) force of each patch [N]; of follower
            loads normal and tangential to the chord of the deformed patch.

        Returns
        -------
        ndarray
            Coefficients of the displacements [m].

        Raises
        ------
        InputError
            If forces are not finite or do not fit the patches, or no stable state is found.
        """
        wanted = np.asarray(forces, dtype=float)
        if wanted.shape != (len(self.centres), 2) or not np.isfinite(wanted).all():
            raise InputError(
                f"Forces of shape {wanted.shape} do not fit {len(self.centres)} patches, or are "
                "not finite; give shape (n, 2) in newtons."
            )
        return self._stepped(self.load(wanted))

    def _stepped(
        self, load: SurfaceLoad, step: float = 1.0, smallest: float = SMALLEST_STEP
    ) -> Array:
        """Displacements in balance with a load, by steps of it as small as it takes."""
        now, reached = np.zeros(self.shape), 0.0
        tangent: Tangent | None = self._unloaded
        while reached < 1:
            try:
                target = load.scaled(min(reached + step, 1.0))
                now, tangent = self._balanced(now, target, tangent)
            except SurfaceFoldError:
                raise
            except InputError as error:
                step, tangent = step / 2, None
                if step < smallest:
                    raise InputError(_end(reached)) from error
                continue
            reached += step
        return now

    def _balanced(
        self,
        now: Array,
        load: SurfaceLoad,
        tangent: Tangent | None,
        tolerance: float = TOLERANCE,
    ) -> tuple[Array, Tangent | None]:
        """Newton's method from one state to the balance with a load."""
        free, last = self._free, np.inf
        for _ in range(ITERATIONS):
            parts, nodal = self._responses(self.gradients(now)), load.nodal(now[..., -1])
            left = (self.on_surface(nodal) - self._forces(parts)).ravel()[free]
            norm = np.linalg.norm(left)
            if norm <= max(tolerance * float(np.linalg.norm(nodal)), ROUNDING):
                if not load.follows and self.surface_stiffness(now).min() <= 0:
                    raise SurfaceFoldError(FOLDS)
                return now, tangent
            if tangent is None or norm > SLOW * last:
                tangent = self._factorised(parts)
            last = norm
            now = now + self._step(tangent, load, now, left)
        raise InputError(
            f"No balance was found in {ITERATIONS} steps. Take smaller loads or wider contacts."
        )

    def _step(self, tangent: Tangent, load: SurfaceLoad, now: Array, left: Array) -> Array:
        """Newton's step from a state, by what is out of balance at the free coefficients.

        With the derivative D of the load, (K - D) x = left for x = K^-1 (left + y), where the
        forces y = D x of the surface follow by GMRES.
        """

        def moved(forces: Array) -> Array:
            found = np.zeros(int(np.prod(self.shape)))
            found[self._free] = tangent.solve(forces)
            return found.reshape(self.shape)

        def followed(state: Array) -> Array:
            return load.changed(now[..., -1], state[..., -1]).ravel()

        def on_free(forces: Array) -> Array:
            return self.on_surface(forces.reshape(2, -1)).ravel()[self._free]

        first = moved(left)
        begin = followed(first)
        if not begin.any():
            return first
        made: Any = LinearOperator  # whose stubs know no functions
        less = made(
            (begin.size, begin.size),
            matvec=lambda forces: forces - followed(moved(on_free(forces))),
            dtype=float,
        )
        forces, _ = gmres(less, begin, rtol=FOLLOWED, restart=KRYLOV, maxiter=1)
        return first + moved(on_free(forces))

    @cached_property
    def _unloaded(self) -> Tangent:
        """The tangent without load."""
        return self.tangent(np.zeros(self.shape))

    def linear(self, loads: Array) -> Array:
        """Displacements of small strain under nodal forces, shape (..., 2, along x, along z)."""
        flat = loads.reshape(-1, int(np.prod(self.shape)))
        return self._solved(self._unloaded, flat).reshape(loads.shape)

    def _solved(self, tangent: Tangent, loads: Array) -> Array:
        """Displacements by a tangent under nodal forces, shape (k, size)."""
        found = np.zeros(loads.shape)
        found[:, self._free] = tangent.solve(loads[:, self._free].T).T
        return found

    def near(self, load: SurfaceLoad, linear: Array, smallest: float = SMALLEST_STEP) -> Array:
        """Displacements in balance with a load as closely as `ENOUGH`.

        From those of small strain, if they lead there.
        """
        try:
            return self._balanced(linear, load, self._unloaded, ENOUGH)[0]
        except SurfaceFoldError:
            raise
        except InputError:  # far beyond small strain
            return self._stepped(load, step=1 / 2, smallest=smallest)

    def spread(self, places: Array, moved: Array) -> tuple[NDArray[Any], NDArray[Any]]:
        """Nodal forces of unit forces at places (...) of the surface, and their slopes [1/m].

        Both of shape (..., along x).  Where loads follow the surface they are complex, x + i z of
        forces along it under its displacements, shape (2, along x).
        """
        shape = (*places.shape, -1)
        at = SurfacePlaces(self.mesh.order, self.mesh.x, places.ravel())
        if self.transducer.loads == "follower":
            own, rising = at.spread(moved)
        else:
            own, rising = (part.toarray() for part in at.shapes)
        return own.reshape(shape), rising.reshape(shape)

    def pressed(self, places: Array, forces: Array) -> SurfaceLoad:
        """Dead loads, or ones that follow the surface, of small forces side by side.

        Parameters
        ----------
        places : ndarray, shape (q,)
            In the undeformed strip [m].
        forces : ndarray, shape (q, 2)
            Normal and tangential, where they follow to the surface at their own place [N].
        """
        load = TurningForces(SurfacePlaces(self.mesh.order, self.mesh.x, places), forces)
        if self.transducer.loads == "dead":
            return DeadLoad(self.at_rest(load))
        return load

    def beside_linear(
        self, load: SurfaceLoad, changes: Changes | None = None, exact: bool = False
    ) -> tuple[Array, Array]:
        """What large strain adds to the stress that the light sees, and its change with the load.

        Parameters
        ----------
        load : SurfaceLoad
            On the strip.
        changes : callable, optional
            Changes of it, nodal forces of shape (k, 2, along x), under displacements of the
            surface, shape (2, along x); none if not given.
        exact : bool
            Whether balance is to `TOLERANCE`, not `ENOUGH`, by as small steps as it takes.

        Returns
        -------
        added : ndarray, shape (M,)
            At the stations [Pa m].
        slopes : ndarray, shape (M, k)
            Its derivative along each change.

        Raises
        ------
        InputError
            If no stable state is found.
        """
        still = np.zeros(self.shape[:2])
        varied = np.zeros((0, *still.shape)) if changes is None else changes(still)
        linear = self.linear(self.on_surface(np.concatenate([load.nodal(still)[None], varied])))
        state = self._stepped(load) if exact else self.near(load, linear[0], FEWEST)
        small = self.light.linear_slopes(linear)
        added = self.light.at_stations(state) - small[:, 0]
        if changes is None or not len(varied):
            return added, small[:, 1:]
        slopes = self.light.slopes(state, self._moved_by(load, state, changes(state[..., -1])))
        return added, slopes - small[:, 1:]

    def _moved_by(self, load: SurfaceLoad, state: Array, forces: Array) -> Array:
        """Change of the displacements in balance with a load with forces on the surface beside it.

        With the derivative D of a load that follows the surface they are K^-1 y with
        y = forces + D K^-1 y, which vanishes where neither forces nor load act.
        """
        tangent = self.tangent(state)

        def moved(nodal: Array) -> Array:
            flat = self.on_surface(nodal).reshape(len(nodal), -1)
            return self._solved(tangent, flat).reshape(-1, *self.shape)

        if not load.follows:
            return moved(forces)
        surface = state[..., -1]
        reached = np.flatnonzero(np.any(forces, axis=(0, 1)) | np.any(load.nodal(surface), axis=0))
        count = 2 * len(reached)
        unit = np.zeros((2, len(reached), 2, surface.shape[1]))
        for component in range(2):
            unit[component, np.arange(len(reached)), component, reached] = 1
        ways = moved(unit.reshape(count, *surface.shape))
        turned = np.array([load.changed(surface, way)[:, reached] for way in ways[..., -1]])
        left = np.eye(count) - turned.reshape(count, count).T
        found = np.linalg.solve(left, forces[:, :, reached].reshape(len(forces), count).T)
        return np.tensordot(found.T, ways, 1)

    @cached_property
    def light(self) -> DeformedLight:
        """What light sees of the strip."""
        return DeformedLight(self.mesh, self._rows, self.photoelastic, self.transducer.plane)


def _both_ways(values: Array, along_x: csr_array, along_z: csr_array) -> Array:
    """Matrices applied along the strip and upwards, to values of shape (2, along x, along z)."""
    _, columns, rows = values.shape
    moved = along_x @ values.swapaxes(0, 1).reshape(columns, -1)
    turned = moved.reshape(-1, 2, rows).transpose(2, 1, 0)
    return (along_z @ turned.reshape(rows, -1)).reshape(-1, *turned.shape[1:]).transpose(1, 2, 0)


def _deformed(coefficients: Array, *ways: tuple[csr_array, csr_array]) -> Array:
    """Deformation gradient F, shape (2, 2, along x, along z).

    By the matrices along the strip and upwards of each of its columns.
    """
    f = np.stack([_both_ways(coefficients, *way) for way in ways], axis=1)
    f[0, 0] += 1
    f[1, 1] += 1
    return f


def _end(share: float) -> str:
    """That no stable state was found beyond a share of loads."""
    return (
        f"No stable state of the strip was found beyond {share:.0%} of these loads: its surface "
        "folds. Take smaller loads or wider contacts."
    )


def finite_strip(
    transducer: Transducer,
    centres: ArrayLike,
    widths: ArrayLike,
    materials: tuple[Hyperelastic, Hyperelastic] | None = None,
    order: int = ORDER,
    share: float = np.inf,
    growth: float = GROWTH_X,
) -> FiniteStrip:
    """A strip under large strain on the mesh that its patches ask for.

    Parameters
    ----------
    transducer : Transducer
        The strip, in plane stress or plane strain.
    centres, widths : array_like, shape (n,)
        Middle and width of each patch [m], widths above 0.
    materials : tuple of Hyperelastic, optional
        Of the compliant and the photoelastic layer; those of the design if not given.
    order : int
        Polynomial order of the elements.
    share : float
        Largest element beside the ends of a patch, along the strip and into it, over the width of
        the patch; ends that are closer together than a quarter of that are one.
    growth : float
        Of elements beside the ends up to the size that they have without a share.

    Raises
    ------
    InputError
        If the strip is three-dimensional, a patch has no width, or it reaches beyond the strip.
    """
    middle, wide = np.asarray(centres, dtype=float), np.asarray(widths, dtype=float)
    if transducer.plane == "3d":
        raise InputError(
            'Large strain is calculated in a plane; take plane = "stress" or "strain".'
        )
    if not np.all(wide > 0):
        raise InputError(
            f"A contact {np.min(wide):g} m wide is a line, under which large strain has no "
            'solution; give it a width, such as tactels.contact_width = "0.5 mm".'
        )
    ends, finest = np.concatenate([middle - wide / 2, middle + wide / 2]), np.tile(share * wide, 2)
    half = transducer.length / 2
    if np.abs(ends).max(initial=0.0) > half * (1 + 1e-9):
        raise InputError(
            f"A contact reaches to {np.abs(ends).max() * 1e3:g} mm from the centre, beyond the "
            f"strip's end at {half * 1e3:g} mm; move it or make it narrower."
        )
    marks, sizes = _apart(ends, finest, half)
    mesh = strip_mesh(transducer, marks, order, sizes, growth)
    compliant, photoelastic = materials or (
        Hyperelastic.of(transducer.compliant),
        Hyperelastic.of(transducer.photoelastic),
    )
    return FiniteStrip(transducer, middle, wide, mesh, compliant, photoelastic)


def _apart(ends: Array, finest: Array, half: float) -> tuple[Array, Array]:
    """Ends of patches between which elements make sense, ascending, and the largest beside them.

    An end of the strip itself is none.
    """
    near = np.where(finest < np.inf, finest / 4, SAME)
    kept = list[int]()
    for k in np.argsort(ends, kind="stable").tolist():
        if half - abs(ends[k]) < near[k]:
            continue
        if kept and ends[k] - ends[kept[-1]] < min(near[k], near[kept[-1]]):
            finest[kept[-1]] = min(finest[kept[-1]], finest[k])
        else:
            kept.append(k)
    return ends[kept], finest[kept]
