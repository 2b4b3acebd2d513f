"""Shares of accelerations by source, from the torques that a result has: q̈_x = M⁻¹ F_x, point by point.

    M q̈ = Σ_i u_i − Σ_js c1_ijs q̇_s − Σ_j g_ij − spring, damping, friction − Σ_e τ_ie

with u_i = τ_i what the joint gives, and armature in M. A point accelerates by J q̈_x, and by J̇ q̇ itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.induced_points import InducedPoint
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.result_columns import SHARE_OF, Column, Quantity
from linkwise.analysis.term_rows import mirrored
from linkwise.analysis.verify import Closure, worst_of
from linkwise.errors import LinkwiseError
from linkwise.escape import column_part
from linkwise.package.load import Array
from linkwise.runtime.sums.inertia_solve import solved_columns

AT_ONCE = 1 << 21
"""Numbers of the sources' forces computed at once."""


@dataclass(frozen=True)
class ForceSource:
    """A source: which of the result's torques are its force on the coordinates."""

    quantity: Quantity
    link: int | None
    cause: int | None
    torques: tuple[tuple[int, int, float], ...]
    """Coordinate, row of the result, and the sign with which the torque drives it."""


@dataclass(frozen=True)
class InducedShares:
    """Plans and fills the columns of induced accelerations, which stand behind all others."""

    robot: LoadedRobot
    points: tuple[InducedPoint, ...]
    sources: tuple[ForceSource, ...]
    columns: tuple[Column, ...]
    first: int
    """Row of the result at which they begin."""

    @classmethod
    def of(
        cls,
        robot: LoadedRobot,
        points: Sequence[InducedPoint],
        others: Sequence[Column],
        loads: Sequence[str],
    ) -> "InducedShares":
        """others: all columns of torques and motion; loads: their names."""
        sources = _sources(others) if points else ()
        columns = tuple(
            column
            for number, point in enumerate(points)
            for row in range(len(point.rows))
            for column in _columns(robot, loads, sources, point, number, row)
        )
        return cls(robot, tuple(points), sources, columns, len(others))

    def fill(self, out: Array, mass: Array, q: Array, qd: Array, qdd: Array) -> Closure:
        """Fill columns of `out` (columns, S), whose torques are there; mass: c2 in the layout's order."""
        worst = Closure()
        numbers = max(1, len(self.sources) * q.shape[1])
        step = max(1, AT_ONCE // numbers)
        for at in range(0, len(q), step) if self.points else ():
            some = slice(at, at + step)
            worst |= self._fill(out[:, some], mass[some], q[some], qd[some], qdd[some])
        return worst

    def _fill(self, out: Array, mass: Array, q: Array, qd: Array, qdd: Array) -> Closure:
        forces = np.zeros((*q.shape, len(self.sources)))
        for x, source in enumerate(self.sources):
            for i, row, sign in source.torques:
                forces[:, i, x] += sign * out[row]
        try:
            moved = solved_columns(self._mass(mass, q.shape[1]), forces, self.robot.joints)
        except ValueError as error:
            raise LinkwiseError(f"--induced: {error}") from error
        row, worst = self.first, Closure()
        for point in self.points:
            jacobian, rate = point.maps(self.robot, q, qd)
            own = np.einsum("src,sc->sr", rate, qd)
            whole = np.einsum("src,sc->sr", jacobian, qdd) + own
            shares = np.concatenate([jacobian @ moved, rate * qd[:, None, :]], axis=2)
            apart = np.abs(shares.sum(axis=2) - whole).max(axis=0, initial=0.0)
            sizes = np.abs(shares).sum(axis=2).max(axis=0, initial=0.0)
            for r, unit in enumerate(point.units):
                out[row] = whole[:, r]
                out[row + 1 : row + 1 + shares.shape[2]] = shares[:, r].T
                row += 1 + shares.shape[2]
                alike = [k for k, other in enumerate(point.units) if other == unit]
                absolute, relative = worst_of([(float(apart[k]), float(sizes[k])) for k in alike])
                worst |= Closure(induced_absolute=absolute, induced_relative=relative)
        return worst

    def _mass(self, packed: Array, n: int) -> Array:
        """M (S, n, n) of links, payloads and what turns behind gears."""
        mass = np.zeros((len(packed), n, n))
        for i, _, k, source in mirrored(self.robot.model.layout):
            mass[:, i, k] += packed[:, source]
        for own in self.robot.passive:
            mass[:, own.coordinate, own.coordinate] += own.ratio**2 * own.armature
        return mass


def _sources(columns: Sequence[Column]) -> tuple[ForceSource, ...]:
    """What drives the coordinates: joints' torques forwards, all that these are needed for backwards."""
    found: dict[tuple[Quantity, int | None, int | None], list[tuple[int, int, float]]] = {}
    for quantity, torque in SHARE_OF.items():
        for row, c in enumerate(columns):
            if c.quantity != torque or c.joint is None:
                continue
            of_links = torque in ("tau_qd", "tau_gravity", "tau_load")
            key = quantity, c.link, c.cause if of_links else c.joint
            found.setdefault(key, []).append((c.joint, row, 1.0 if torque == "tau" else -1.0))
    return tuple(ForceSource(*key, tuple(torques)) for key, torques in found.items())


def _columns(
    robot: LoadedRobot,
    loads: Sequence[str],
    sources: Sequence[ForceSource],
    point: InducedPoint,
    number: int,
    row: int,
) -> list[Column]:
    """Of one component of a point: its acceleration, the shares of the sources, and J̇ q̇ by its causes."""
    unit = point.units[row]

    def column(quantity: Quantity, link: int | None, cause: int | None, names: Sequence[str]) -> Column:
        name = "/".join([quantity, *map(column_part, (point.name, point.rows[row], *names))])
        return Column(quantity, name, unit, None, link, cause, number, row)

    made = [column("acc", None, None, ())]
    for source in sources:
        causes = loads if source.quantity == "acc_load" else robot.joints
        names = [] if source.link is None else [robot.links[source.link]]
        names += [] if source.cause is None else [causes[source.cause]]
        made.append(column(source.quantity, source.link, source.cause, names))
    made += [column("acc_kinematic", None, s, [joint]) for s, joint in enumerate(robot.joints)]
    return made
