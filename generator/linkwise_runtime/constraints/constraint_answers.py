"""The calls of `Constraints` behind its face, composed of the rows of ties and the calls of the open tree."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import shape_of
from ..quantities import Coefficients, ConstrainedMotion, Propagation
from ..sums.inertia_solve import solved
from ..sums.namespace import hidden, namespace, side_by_side
from .chosen_constraints import ChosenConstraints
from .closed_places import ClosedPlace, RowNames, TiesAt, closed_place, followed
from .followers import Followers, borne, joint_columns, projected, times
from .led_positions import led
from .newton_closing import closed, with_independent
from .tie_rows import TieRows


class ConstraintAnswers:
    """The calls on a robot; arguments as `Constraints` says."""

    def __init__(self, robot: Any, chosen: ChosenConstraints, rows: TieRows, tolerance: float | None) -> None:
        """`robot` answers for the open tree."""
        self.robot = robot
        self._chosen, self._tie_rows, self._tolerance = chosen, rows, tolerance
        self._columns = joint_columns(chosen.independent, robot.n)
        self.names, self.rows, self.row_units = chosen.names, chosen.rows, chosen.row_units
        self.independent = tuple(robot.joint_names[k] for k in self._columns.independent)
        self.dependent = tuple(robot.joint_names[k] for k in self._columns.dependent)
        self._told = RowNames(chosen.rows, chosen.row_names, robot.joint_names)
        self._listed: dict[Any, Any] = {}

    @property
    def redundant(self) -> tuple[str, ...]:
        """See `Constraints.redundant`."""
        return self._chosen.redundant

    def violation(self, q: Any, held_at: Any) -> Any:
        """See `Constraints.violation`."""
        return self._tie_rows.violation(q, q if held_at is None else held_at)

    def jacobian(self, q: Any) -> Any:
        """See `Constraints.jacobian`."""
        (q,) = self._read(q=q)
        return side_by_side(self._tie_rows.at(q).positions()[..., 1:])

    def jacobian_rate(self, q: Any, qd: Any) -> Any:
        """See `Constraints.jacobian_rate`."""
        return self._tie_rows.rates(q, qd)

    @cached_property
    def closed_position(self) -> NDArray[np.float64]:
        """See `Constraints.closed_position`."""
        read = self._read(q=self._chosen.closed_position)[0]
        with _without_gradient(read):
            found = self._closed(read, None).q
        position: NDArray[np.float64] = found if isinstance(found, np.ndarray) else found.cpu().numpy()
        return position.copy()

    def closed(self, q: Any, held_at: Any, start: Any) -> Any:
        """See `Constraints.closed`."""
        if shape_of(q)[-1:] == (len(self.independent),):
            return self._led(q, held_at, start)
        if start is not None:
            m = len(self.independent)
            raise ValueError(
                f"start is where joints are led from that q does not have, and q has shape {shape_of(q)}; "
                f"leave it out, or give q the {m} independent joints alone"
            )
        return self._closed(q, held_at).q

    def _led(self, own: Any, held_at: Any, start: Any) -> Any:
        """Closed positions for independent joints (..., m)."""
        (own,) = self.robot.backend.arrays({"q": own}, len(self.independent))
        if hidden(own):
            raise ValueError(
                "joints cannot be led where nobody may look at numbers, as under vmap or a compiler; give "
                f"closed(q) all {self.robot.n} joints"
            )
        begin = self.robot.backend.weights("start", self.closed_position if start is None else start, own)
        if begin.shape[-1:] != (self.robot.n,):
            raise ValueError(
                f"start has shape {tuple(begin.shape)}; give a closed position ({self.robot.n},)"
            )
        columns = self._own_columns(own)
        begin = begin + 0.0 * own[..., :1]
        held_at = begin if held_at is None else held_at
        with _without_gradient(own):
            found = led(lambda q: self.closed_place(q, held_at), begin, own, columns, self.robot.joint_names)
        return self._closed(with_independent(found, own, columns), held_at).q

    def velocity_map(self, q: Any) -> Any:
        """See `Constraints.velocity_map`."""
        (q,) = self._read(q=q)
        return side_by_side(self._place(q).found.map)

    def velocity(self, q: Any, yd: Any) -> Any:
        """See `Constraints.velocity`."""
        (q,) = self._read(q=q)
        return self._place(q).velocity(self._own("yd", yd, q))

    def acceleration(self, q: Any, qd: Any, ydd: Any) -> Any:
        """See `Constraints.acceleration`."""
        place, q, qd = self._moving(q, qd)
        return place.velocity(self._own("ydd", ydd, q)) + place.bias(qd)

    def velocity_accelerations(self, q: Any, qd: Any) -> Any:
        """See `Constraints.velocity_accelerations`."""
        place, _, qd = self._moving(q, qd)
        return place.bias_by_cause(qd)

    def projected(self, q: Any, torque: Any, by_link: bool) -> Any:
        """See `Constraints.projected`."""
        (q,) = self._read(q=q)
        answer = projected(self._place(q).found, self._torque(torque, q, by_link))
        return answer if by_link else answer[..., 0]

    def inverse_dynamics(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.inverse_dynamics`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return projected(found, self.robot.inverse_dynamics(*motion)[..., None])[..., 0]

    def partial_torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.partial_torque`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return projected(found, self.robot.partial_torque(*motion))

    def coefficients(self, q: Any, qd: Any) -> Any:
        """See `Constraints.coefficients`."""
        return self._coefficients(*self._moving(q, qd))

    def propagation(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.propagation`."""
        q, qd, qdd = self._read(q=q, qd=qd, qdd=qdd)
        place, q, qd = self._moving(q, qd)
        c2, c1, g = self._coefficients(place, q, qd)
        yd, ydd = (place.own(a)[..., None, None, :] for a in (qd, qdd))
        return Propagation(c2 * ydd, c1 * yd, g)

    def forces(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.forces`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return borne(found, self.robot.partial_torque(*motion))

    def forces_of(self, q: Any, torque: Any, by_link: bool) -> Any:
        """See `Constraints.forces_of`."""
        (q,) = self._read(q=q)
        answer = borne(self._place(q).found, self._torque(torque, q, by_link))
        return answer if by_link else answer[..., 0]

    def forward_dynamics(self, q: Any, qd: Any, tau: Any, passive: bool) -> Any:
        """Solve (G^T M G) ydd = G^T (tau - h - g - M bias), then A^T lambda = M qdd + h + g - tau."""
        q, qd, tau = self._read(q=q, qd=qd, tau=tau)
        place, q, qd = self._moving(q, qd)
        mass, force = self._driven(q, qd, tau, passive)
        bias = place.bias(qd)
        qdd = place.velocity(self._solved(place, mass, force, bias)) + bias
        forces = borne(place.found, (times(mass, qdd) - force)[..., None])[..., 0]
        return ConstrainedMotion(qdd, forces)

    def closed_place(self, q: Any, held_at: Any) -> ClosedPlace:
        """The place of `closed`, and how joints follow there; raises as calls at q do."""
        at = self._closed(q, held_at)
        return followed(at, self._own_columns(at.q), self._told)

    def independent_acceleration(self, place: ClosedPlace, qd: Any, tau: Any, passive: bool) -> Any:
        """ydd of `forward_dynamics` at a place, (..., m), for motion that has been read and follows."""
        mass, force = self._driven(place.q, qd, tau, passive)
        return self._solved(place, mass, force, place.bias(qd))

    def _driven(self, q: Any, qd: Any, tau: Any, passive: bool) -> tuple[Any, Any]:
        """M and tau - h - g, of joints and of links or of links alone."""
        robot, rest = self.robot, 0.0 * qd
        mass, force = robot.mass_matrix(q), tau - robot.inverse_dynamics(q, qd, rest)
        if not (passive and robot.structure.passive):
            return mass, force
        armature = robot.backend.constant(robot.structure.passive_sums.armature, q)
        return mass + namespace(q).diag(armature), force - robot.passive_torque(q, qd, rest).total

    def _solved(self, place: ClosedPlace, mass: Any, force: Any, bias: Any) -> Any:
        """ydd (..., m)."""
        found = place.found
        driven = projected(found, (force - times(mass, bias))[..., None])[..., 0]
        return solved(projected(found, mass @ found.map), driven, self.independent)

    def _closed(self, q: Any, held_at: Any) -> TiesAt:
        q, held_at = self._read(q=q, held_at=q if held_at is None else held_at)
        return closed(self._tie_rows, self._own_columns(q), q, held_at, self._tolerance, self._told)

    def _coefficients(self, place: ClosedPlace, q: Any, qd: Any) -> Any:
        """c2^ = G^T c2 G, c1^ = G^T (c2 dG/dt + c1 G), g^ = G^T g, for each link."""
        c2, c1, g = self.robot.coefficients(q, qd)
        found, rate = place.found, place.map_rate(qd)[..., None, :, :]
        mapped = found.map[..., None, :, :]
        acceleration, velocity = c2 @ mapped, c2 @ rate + c1 @ mapped
        return Coefficients(
            _projected_cubes(found, acceleration), _projected_cubes(found, velocity), projected(found, g)
        )

    def _read(self, **named: Any) -> Sequence[Any]:
        read: Sequence[Any] = self.robot.backend.arrays(named, self.robot.n)
        return read

    def _own(self, name: str, given: Any, q: Any) -> Any:
        """What is given of the independent joints, (..., m)."""
        values, m = self.robot.backend.weights(name, given, q), len(self.independent)
        if values.ndim == 0 or values.shape[-1] != m:
            told = f"its last axis must be {m}, one for each of {', '.join(self.independent)}"
            raise ValueError(f"{name} has shape {tuple(values.shape)}; {told}")
        return values

    def _torque(self, given: Any, q: Any, by_link: bool) -> Any:
        """Torques (..., n, X)."""
        values, axis = self.robot.backend.weights("torque", given, q), -2 if by_link else -1
        if values.ndim < -axis or values.shape[axis] != self.robot.n:
            shape = "(..., n, X)" if by_link else "(..., n), or with by_link=True (..., n, X)"
            raise ValueError(f"torque has shape {tuple(values.shape)}; give {shape}, n = {self.robot.n}")
        return values if by_link else values[..., None]

    def _own_columns(self, q: Any) -> Any:
        key = type(q), getattr(q, "device", None)
        if key not in self._listed:
            backend = self.robot.backend
            self._listed[key] = type(self._columns)(*(backend.index(a, q) for a in self._columns))
        return self._listed[key]

    def _place(self, q: Any) -> ClosedPlace:
        """How joints follow at q (..., n), in which all ties close."""
        return closed_place(self._tie_rows, self._own_columns(q), q, self._tolerance, self._told)

    def _moving(self, q: Any, qd: Any) -> tuple[ClosedPlace, Any, Any]:
        """The same, q, and qd in which all joints follow."""
        q, qd = self._read(q=q, qd=qd)
        place = self._place(q)
        return place, q, place.velocity(place.own(qd))

    def _accelerated(self, q: Any, qd: Any, qdd: Any) -> tuple[Followers, Any, Any, Any]:
        """How joints follow, and a motion in which they do."""
        q, qd, qdd = self._read(q=q, qd=qd, qdd=qdd)
        place, q, qd = self._moving(q, qd)
        return place.found, q, qd, place.velocity(place.own(qdd)) + place.bias(qd)


def _without_gradient(like: Any) -> Any:
    return nullcontext() if isinstance(like, np.ndarray) else namespace(like).no_grad()


def _projected_cubes(found: Followers, parts: Any) -> Any:
    """G^T over i of (..., n, N, m)."""
    *batch, n, links, m = parts.shape
    flat = projected(found, parts.reshape(*batch, n, links * m))
    return flat.reshape(*batch, m, links, m)


def constraint_answers(
    robot: Any,
    independent: Any,
    contacts: Any,
    at: Any,
    tolerance: Any,
    made: Callable[[ChosenConstraints], TieRows],
) -> ConstraintAnswers:
    """The calls on a robot, with the rows that are made of what was chosen.

    Raises as `Dynamics.constrained` does.
    """
    backend, structure = robot.backend, robot.structure
    if backend.tree is None:
        raise ValueError(
            f"the links of {structure.name} are energies, which do not say where anything is; constraints "
            "are there for rigid links"
        )
    if tolerance is not None and not (isinstance(tolerance, float | int) and tolerance >= 0.0):
        raise ValueError(f"tolerance is {tolerance!r}; give a number of m and rad, 0 or more")
    chosen = ChosenConstraints(structure, backend.tree, independent, contacts, at)
    return ConstraintAnswers(robot, chosen, made(chosen), tolerance)
