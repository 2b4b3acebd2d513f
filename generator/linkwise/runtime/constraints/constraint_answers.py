"""The calls of `Constraints` behind its face, composed of the rows of ties and the calls of the open tree."""

from collections.abc import Sequence
from typing import Any

from ..quantities import Coefficients, ConstrainedMotion, Propagation
from ..rule.kinematics import taken
from ..sums.inertia_solve import solved
from ..sums.namespace import namespace, side_by_side
from .chosen_constraints import ChosenConstraints
from .followers import (
    Followers,
    borne,
    dependent_shares,
    factored,
    followers,
    joint_columns,
    projected,
)
from .newton_closing import closed
from .singular_positions import check_closed, check_factors, check_following
from .tie_rows import TieRows


class ConstraintAnswers:
    """The calls on a robot; arguments as `Constraints` says."""

    def __init__(self, robot: Any, chosen: ChosenConstraints, rows: TieRows, tolerance: float | None) -> None:
        """`robot` answers for the open tree."""
        self._robot, self._chosen, self._tie_rows, self._tolerance = robot, chosen, rows, tolerance
        self._columns = joint_columns(chosen.independent, robot.n)
        self.names, self.rows = chosen.names, chosen.rows
        self.independent = tuple(robot.joint_names[k] for k in self._columns.independent)
        self.dependent = tuple(robot.joint_names[k] for k in self._columns.dependent)
        self._listed: dict[Any, Any] = {}

    @property
    def redundant(self) -> tuple[str, ...]:
        """See `Constraints.redundant`."""
        return self._chosen.redundant

    def violation(self, q: Any, held_at: Any) -> Any:
        """See `Constraints.violation`."""
        return self._tie_rows.violation(q, held_at)

    def jacobian(self, q: Any) -> Any:
        """See `Constraints.jacobian`."""
        return side_by_side(self._tie_rows.positions(q)[..., 1:])

    def jacobian_rate(self, q: Any, qd: Any) -> Any:
        """See `Constraints.jacobian_rate`."""
        return self._tie_rows.rates(q, qd)

    def closed(self, q: Any, held_at: Any) -> Any:
        """See `Constraints.closed`."""
        (q,) = self._read(q=q)
        names = self.rows, self._chosen.row_names, self._robot.joint_names
        return closed(self._tie_rows, self._own_columns(q), q, held_at, self._tolerance, names)

    def velocity_map(self, q: Any) -> Any:
        """See `Constraints.velocity_map`."""
        (q,) = self._read(q=q)
        return side_by_side(self._followers(q).map)

    def velocity(self, q: Any, yd: Any) -> Any:
        """See `Constraints.velocity`."""
        (q,) = self._read(q=q)
        return _times(self._followers(q).map, self._own("yd", yd, q))

    def acceleration(self, q: Any, qd: Any, ydd: Any) -> Any:
        """See `Constraints.acceleration`."""
        q, qd = self._read(q=q, qd=qd)
        found, qd = self._moving(q, qd)
        return _times(found.map, self._own("ydd", ydd, q)) + self._bias(found, q, qd)

    def velocity_accelerations(self, q: Any, qd: Any) -> Any:
        """See `Constraints.velocity_accelerations`."""
        q, qd = self._read(q=q, qd=qd)
        found, qd = self._moving(q, qd)
        return dependent_shares(found, self._tie_rows.rates(q, qd) * qd[..., None, :])

    def projected(self, q: Any, torque: Any, by_link: bool) -> Any:
        """See `Constraints.projected`."""
        (q,) = self._read(q=q)
        given = self._torque(torque, q, by_link)
        answer = projected(self._followers(q), given)
        return answer if by_link else answer[..., 0]

    def inverse_dynamics(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.inverse_dynamics`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return projected(found, self._robot.inverse_dynamics(*motion)[..., None])[..., 0]

    def partial_torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.partial_torque`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return projected(found, self._robot.partial_torque(*motion))

    def coefficients(self, q: Any, qd: Any) -> Any:
        """See `Constraints.coefficients`."""
        q, qd = self._read(q=q, qd=qd)
        found, qd = self._moving(q, qd)
        return self._coefficients(found, q, qd)

    def propagation(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.propagation`."""
        q, qd, qdd = self._read(q=q, qd=qd, qdd=qdd)
        found, qd = self._moving(q, qd)
        c2, c1, g = self._coefficients(found, q, qd)
        yd, ydd = (taken(a, found.columns.independent, -1)[..., None, None, :] for a in (qd, qdd))
        return Propagation(c2 * ydd, c1 * yd, g)

    def forces(self, q: Any, qd: Any, qdd: Any) -> Any:
        """See `Constraints.forces`."""
        found, *motion = self._accelerated(q, qd, qdd)
        return borne(found, self._robot.partial_torque(*motion))

    def forces_of(self, q: Any, torque: Any, by_link: bool) -> Any:
        """See `Constraints.forces_of`."""
        (q,) = self._read(q=q)
        given = self._torque(torque, q, by_link)
        answer = borne(self._followers(q), given)
        return answer if by_link else answer[..., 0]

    def forward_dynamics(self, q: Any, qd: Any, tau: Any, passive: bool) -> Any:
        """Solve (G^T M G) ydd = G^T (tau - h - g - M bias), then A^T lambda = M qdd + h + g - tau."""
        q, qd, tau = self._read(q=q, qd=qd, tau=tau)
        found, qd = self._moving(q, qd)
        robot, rest = self._robot, 0.0 * qd
        mass, force = robot.mass_matrix(q), tau - robot.inverse_dynamics(q, qd, rest)
        if passive:
            armature = robot.backend.constant(robot.structure.passive_sums.armature, q)
            mass = mass + namespace(q).diag(armature)
            force = force - robot.passive_torque(q, qd, rest).total
        bias = self._bias(found, q, qd)
        driven = projected(found, (force - _times(mass, bias))[..., None])[..., 0]
        ydd = solved(projected(found, mass @ found.map), driven, self.independent)
        qdd = _times(found.map, ydd) + bias
        forces = borne(found, (_times(mass, qdd) - force)[..., None])[..., 0]
        return ConstrainedMotion(qdd, forces)

    def _coefficients(self, found: Followers, q: Any, qd: Any) -> Any:
        """c2^ = G^T c2 G, c1^ = G^T (c2 dG/dt + c1 G), g^ = G^T g, for each link."""
        c2, c1, g = self._robot.coefficients(q, qd)
        mapped = found.map[..., None, :, :]
        rate = dependent_shares(found, self._tie_rows.rates(q, qd) @ found.map)[..., None, :, :]
        parts = (_projected_cubes(found, part) for part in (c2 @ mapped, c2 @ rate + c1 @ mapped))
        acceleration, velocity = parts
        return Coefficients(acceleration, velocity, projected(found, g))

    def _read(self, **named: Any) -> Sequence[Any]:
        read: Sequence[Any] = self._robot.backend.arrays(named, self._robot.n)
        return read

    def _own(self, name: str, given: Any, q: Any) -> Any:
        """What is given of the independent joints, (..., m)."""
        values, m = self._robot.backend.weights(name, given, q), len(self.independent)
        if values.ndim == 0 or values.shape[-1] != m:
            told = f"its last axis must be {m}, one for each of {', '.join(self.independent)}"
            raise ValueError(f"{name} has shape {tuple(values.shape)}; {told}")
        return values

    def _torque(self, given: Any, q: Any, by_link: bool) -> Any:
        """Torques (..., n, X)."""
        values, axis = self._robot.backend.weights("torque", given, q), -2 if by_link else -1
        if values.ndim < -axis or values.shape[axis] != self._robot.n:
            shape = "(..., n, X)" if by_link else "(..., n), or with by_link=True (..., n, X)"
            raise ValueError(f"torque has shape {tuple(values.shape)}; give {shape}, n = {self._robot.n}")
        return values if by_link else values[..., None]

    def _own_columns(self, q: Any) -> Any:
        key = type(q), getattr(q, "device", None)
        if key not in self._listed:
            backend = self._robot.backend
            self._listed[key] = type(self._columns)(*(backend.index(a, q) for a in self._columns))
        return self._listed[key]

    def _followers(self, q: Any) -> Followers:
        """How joints follow at q, in which all ties close."""
        positions = self._tie_rows.positions(q)
        check_closed(positions[..., 0], self._tolerance, self.rows, self._chosen.row_names)
        rows, columns = positions[..., 1:], self._own_columns(q)
        factors, names = factored(rows, columns), self._robot.joint_names
        check_factors(rows, factors[1], self._columns, names)
        found = followers(rows, columns, factors)
        check_following(rows, found, self._chosen.row_names, names)
        return found

    def _moving(self, q: Any, qd: Any) -> tuple[Followers, Any]:
        """The same, and qd in which all joints follow."""
        found = self._followers(q)
        return found, _times(found.map, taken(qd, found.columns.independent, -1))

    def _accelerated(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """How joints follow, and a motion in which they do."""
        q, qd, qdd = self._read(q=q, qd=qd, qdd=qdd)
        found, qd = self._moving(q, qd)
        ydd = taken(qdd, found.columns.independent, -1)
        return found, q, qd, _times(found.map, ydd) + self._bias(found, q, qd)

    def _bias(self, found: Followers, q: Any, qd: Any) -> Any:
        """-A_d^+ dA/dt qd on the dependent joints."""
        return dependent_shares(found, self._tie_rows.rates(q, qd) @ qd[..., None])[..., 0]


def _times(matrix: Any, vector: Any) -> Any:
    return (matrix @ vector[..., None])[..., 0]


def _projected_cubes(found: Followers, parts: Any) -> Any:
    """G^T over i of (..., n, N, m)."""
    *batch, n, links, m = parts.shape
    flat = projected(found, parts.reshape(*batch, n, links * m))
    return flat.reshape(*batch, m, links, m)


def constraint_answers(
    robot: Any, independent: Any, contacts: Any, at: Any, tolerance: Any
) -> ConstraintAnswers:
    """The calls on a robot; raises as `Dynamics.constrained` does."""
    backend, structure = robot.backend, robot.structure
    if backend.tree is None:
        raise ValueError(
            f"the links of {structure.name} are energies, which do not say where anything is; constraints "
            "are there for rigid links"
        )
    if tolerance is not None and not (isinstance(tolerance, float | int) and tolerance >= 0.0):
        raise ValueError(f"tolerance is {tolerance!r}; give a number of m and rad, 0 or more")
    chosen = ChosenConstraints(structure, backend.tree, independent, contacts, at)
    beside = robot._answers.read_beside_motion
    rows = TieRows(structure, backend, robot.check_finite, beside, chosen.tables, len(chosen.rows))
    return ConstraintAnswers(robot, chosen, rows, tolerance)
