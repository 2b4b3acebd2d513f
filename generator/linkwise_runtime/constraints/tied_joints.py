"""Motion of a robot's tied joints and the forces that cause it, for arguments that have been read."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any, cast

import numpy as np

from ..answers.inertia_solve import solve_inertia
from ..answers.packed import TiedFunctions
from ..arrays.backend import ArrayBackend
from ..interface import Numbers, namespace
from ..structure import Structure
from .chosen_constraints import ChosenConstraints
from .closed_places import (
    ClosedPlace,
    RowNames,
    TiesAt,
    checked_place,
    closed_place,
    independent_torque,
    tie_forces,
    ties_at,
    times,
)
from .independent_joints import JointColumns, joint_columns
from .newton_closing import closed
from .rows import ConstraintRows


class TiedJoints:
    """Chosen constraints, for any back end; tables are made when first asked for."""

    def __init__(
        self,
        structure: Structure,
        chosen: ChosenConstraints,
        tolerance: float | None,
        rows: Callable[[ArrayBackend], ConstraintRows],
    ) -> None:
        """Keep the choice, and the function that returns its rows on a back end."""
        self.chosen, self._tolerance, self._rows_on = chosen, tolerance, rows
        self._listed = joint_columns(chosen.independent, structure.n)
        self.independent, self.dependent = (
            tuple(structure.joint_names[k] for k in columns.tolist()) for columns in self._listed[:2]
        )
        """Names of the independent and of the dependent joints."""
        self._names = RowNames(chosen.rows, chosen.row_names, structure.joint_names)
        self._columns: dict[object, JointColumns] = {}
        self._rows: dict[ArrayBackend, ConstraintRows] = {}

    def rows(self, backend: ArrayBackend) -> ConstraintRows:
        """Return the rows of the constraints on a back end."""
        if backend not in self._rows:
            self._rows[backend] = self._rows_on(backend)
        return self._rows[backend]

    def functions(self, backend: ArrayBackend) -> TiedFunctions | None:
        """Return a back end's own functions for the constraints; None without any."""
        return self.rows(backend).functions

    def columns(self, backend: ArrayBackend, q: Numbers) -> JointColumns:
        """Return the indices of the joints, for taking entries of `q`."""
        key = type(q), getattr(q, "device", None)
        if key not in self._columns:
            self._columns[key] = JointColumns(*(backend.index(a, q) for a in self._listed))
        return self._columns[key]

    def place(self, backend: ArrayBackend, q: Numbers) -> ClosedPlace:
        """Return how joints follow at q (..., n), in which all ties close; raises as `Constraints` says."""
        shares = self._shares(backend, q)
        return closed_place(
            self.rows(backend), self.columns(backend, q), q, self._tolerance, self._names, shares
        )

    def _shares(self, backend: ArrayBackend, like: Numbers) -> Numbers | None:
        """Return W^(-1/2) of the rows' forces; None where all weigh alike."""
        weight = self.chosen.force_weight
        return None if weight is None else backend.constant(weight**-0.5, like)

    def closed(
        self, backend: ArrayBackend, q: Numbers, held_at: Numbers, columns: JointColumns | None = None
    ) -> TiesAt:
        """Return the ties once dependent joints close them.

        held_at: where contacts took hold, (..., n)
        columns: other independent joints than the chosen ones
        """
        columns = columns or self.columns(backend, q)
        return closed(self.rows(backend), columns, q, held_at, self._tolerance, self._names)

    def closed_place(
        self, backend: ArrayBackend, q: Numbers, held_at: Numbers, columns: JointColumns | None = None
    ) -> ClosedPlace:
        """Return how joints follow once dependent joints close the ties; see `closed`."""
        at = self.closed(backend, q, held_at, columns)
        columns = columns or self.columns(backend, at.q)
        return checked_place(at, columns, self._names, self._shares(backend, at.q))

    def scaled_rows(self, backend: ArrayBackend, q: Numbers) -> Numbers:
        """Return A (..., C, n) at any q, with its rows divided by their sizes."""
        return ties_at(self.rows(backend), self.columns(backend, q), q).rows

    def motion(
        self, backend: ArrayBackend, place: ClosedPlace, qd: Numbers, tau: Numbers, passive: bool
    ) -> tuple[Numbers, Numbers]:
        """Return qdd (..., n) and lambda (..., C) under torques (..., n), at velocities that follow.

        (G^T M G) ydd = G^T (tau - h - g - M bias), then A^T lambda = M qdd + h + g - tau.
        """
        mass, bias = backend.answers.equations(place.q, qd, passive)
        force, own = tau - bias, place.bias(qd)
        qdd = place.velocity(self._solved(place, mass, force, own)) + own
        return qdd, tie_forces(place.found, (times(mass, qdd) - force)[..., None])[..., 0]

    def acceleration(
        self, backend: ArrayBackend, place: ClosedPlace, qd: Numbers, tau: Numbers, passive: bool
    ) -> Numbers:
        """Return qdd (..., n) under torques (..., n), at velocities that follow."""
        mass, bias = backend.answers.equations(place.q, qd, passive)
        own = place.bias(qd)
        return place.velocity(self._solved(place, mass, tau - bias, own)) + own

    def coefficients(
        self, backend: ArrayBackend, place: ClosedPlace, qd: Numbers
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return c2^ = G^T c2 G, c1^ = G^T (c2 dG/dt + c1 G) and g^ = G^T g, for each link."""
        acceleration, velocity, g = self._moved_coefficients(backend, place, qd)
        left = partial(independent_torque, place.found)
        return _projected_cubes(left, acceleration), _projected_cubes(left, velocity), left(g)

    def force_coefficients(
        self, backend: ArrayBackend, place: ClosedPlace, qd: Numbers
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return what rows bear of these, A_d^+T times c2 G, c2 dG/dt + c1 G and g, for each link."""
        acceleration, velocity, g = self._moved_coefficients(backend, place, qd)
        left = partial(tie_forces, place.found)
        return _projected_cubes(left, acceleration), _projected_cubes(left, velocity), left(g)

    def _moved_coefficients(
        self, backend: ArrayBackend, place: ClosedPlace, qd: Numbers
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return c2 G, c2 dG/dt + c1 G and g of all joints."""
        c2, c1, g = backend.answers.coefficients(place.q, qd)
        mapped, rate = (a[..., None, :, :] for a in (place.found.map, place.map_rate(qd)))
        return c2 @ mapped, c2 @ rate + c1 @ mapped, g

    def _solved(self, place: ClosedPlace, mass: Numbers, force: Numbers, bias: Numbers) -> Numbers:
        found = place.found
        driven = independent_torque(found, (force - times(mass, bias))[..., None])[..., 0]
        chosen = any(found.columns is one for one in self._columns.values())
        names = self.independent if chosen else found.columns.names(self._names.joints)
        return solve_inertia(independent_torque(found, mass @ found.map), driven, names)


def without_gradient(like: Numbers) -> AbstractContextManager[object]:
    """Return a context within which nothing is recorded for gradients."""
    return nullcontext() if isinstance(like, np.ndarray) else cast(Any, namespace(like)).no_grad()


def _projected_cubes(left: Callable[[Numbers], Numbers], parts: Numbers) -> Numbers:
    """Return G^T, or what else turns torques (..., n, X) into rows, over i of parts (..., n, N, m)."""
    *batch, n, links, m = parts.shape
    flat = left(parts.reshape(*batch, n, links * m))
    cubes: Numbers = flat.reshape(*batch, flat.shape[-2], links, m)
    return cubes
