"""Deviations of torques of an open tree that compiled code and regressors know, row by row.

With c the share of a product of c and a cause's motion b, bodies add (b^2 + var(b)) var(c) to its variance by
motion alone: they are independent of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
from linkwise_runtime.certainty.motion_variances import WITH_MOTION
from linkwise_runtime.certainty.share_variances import PackedVariances, ShareVariances
from linkwise_runtime.structure import passive_sums

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.settings import Convention
from linkwise.analysis.turned_rows import taken, turned
from linkwise.analysis.uncertain_motion import MotionNoise
from linkwise.arrays import Array, Index

Motion = tuple[Array, Array, Array]
"""q, qd and qdd, (S, n) each."""
ORDERS = ("q", "qd", "qdd")


class KnownQuantity(NamedTuple):
    """Quantity whose variances are known, as packed values in the order of a field of `Layout`."""

    name: str
    """Name of its variance by motion, as of `motion_variances`."""
    field: str
    share: str
    """Name of the share that it is, or is a product of, among `PackedVariances`."""
    cause: str = ""
    """Motion that the share is multiplied by; "" for a share itself."""
    axis: int = 0
    """Axis of the quantity along which that motion has its coordinate."""


BY_LINK = {
    "tau_link": KnownQuantity("torque", "torque", "torque"),
    "tau_gravity": KnownQuantity("gravity", "gravity", "gravity"),
    "tau_qdd": KnownQuantity("acceleration", "velocity", "c2", "qdd", 2),
    "tau_qd": KnownQuantity("velocity", "velocity", "c1", "qd", 2),
    "power_link": KnownQuantity("power", "torque", "torque", "qd", 0),
}
"""Quantities by link whose variances are known."""
OWN = {"tau_spring": "q", "tau_damping": "qd", "tau_armature": "qdd"}
"""Torques that joints take for what they have of their own, each a number times its motion."""
OF_JOINTS = ("tau", *OWN, "power")
"""Quantities of joints whose variances are known where there is no friction and no load."""
FIELD_OF_SHARE = {"c2": "acceleration", "c1": "velocity", "gravity": "gravity", "torque": "torque"}
"""Fields of `Layout` in whose order shares are."""


class Variances(NamedTuple):
    """Variances of the rows of a quantity, (rows, S), by motion and by all that is uncertain."""

    moved: Array
    every: Array


class KnownParts(NamedTuple):
    """Parts of which the variances of some samples are made."""

    moved: Mapping[str, Array]
    """Packed variances by motion, (entries, S), by the names of `motion_variances`."""
    borne: PackedVariances | None
    """Variances by bodies."""
    spreads: Array
    """Covariances of q, qd and qdd of each joint by itself, (3, 3, n, S) or (3, 3, n, 1)."""
    squares: Sequence[Array]
    """Means of the squares of q, qd and qdd, (n, S) each."""


@dataclass(frozen=True)
class KnownDeviations:
    """Finds the variances of `BY_LINK` and of the motion for the rows of a result."""

    robot: OpenedRobot
    convention: Convention
    rows: ResultRows
    quantities: tuple[str, ...]
    """Quantities that are wanted."""
    bodies: ShareVariances | None
    noise: MotionNoise | None

    def parts(self, time: Array, motion: Motion) -> KnownParts:
        """Return what the variances at samples are made of."""
        backend, at = self.robot.model.door.read(dict(zip(ORDERS, motion, strict=True)))
        n = len(self.robot.joints)
        spreads, moved = np.zeros((3, 3, n, 1)), {}
        if self.noise is not None:
            roots = self.noise.roots(time)
            apart = roots.reshape(len(roots), 3, n, -1)
            spreads = np.einsum("sxkr,sykr->xyks", apart, apart)
            names = [BY_LINK[name].name for name in self.quantities if name in BY_LINK]
            if "tau" in self.quantities:
                names += ["joint_torque", WITH_MOTION]
            moved = cast("dict[str, Array]", backend.motion_variances(at, roots, names))
        borne = None if self.bodies is None else self.bodies.packed(at, with_sums=False)
        squares = [a.T**2 + spreads[x, x] for x, a in enumerate(motion)]
        return KnownParts(moved, borne, spreads, squares)

    def find(self, out: Array, parts: KnownParts) -> Iterator[tuple[str, Variances]]:
        """Yield the variances of each quantity; the next step overwrites what they lie in.

        out: the result (rows, S), whose torques are filled
        """
        joints = self._of_joints(out, parts) if "tau" in self.quantities else {}
        for name in self.quantities:
            if name in ORDERS or name in OWN:
                x = ORDERS.index(OWN.get(name, name))
                factor = 1.0 if name in ORDERS else self._own[x, :, None] ** 2
                spread = (factor * parts.spreads[x, x])[self.rows[name].at[:, 0]]
                yield name, Variances(spread, spread)
            elif name in joints:
                yield name, joints[name]
            else:
                yield name, self._of(name, parts)

    @cached_property
    def _own(self) -> Array:
        """Stiffness, damping and armature of each joint, (3, n)."""
        found = passive_sums(self.robot.passive, len(self.robot.joints))
        return np.array([found.stiffness, found.damping, found.armature])

    def _of_joints(self, out: Array, parts: KnownParts) -> dict[str, Variances]:
        """Return the variances of the joints' torques and powers."""
        own, at = self._own[..., None], self.rows["tau"].at[:, 0]
        n, samples = own.shape[1], out.shape[1]
        with_links = parts.moved.get(WITH_MOTION, np.zeros((3 * n, samples))).reshape(3, n, samples)
        of_own = (own * parts.spreads).sum(1)  # covariances of what joints have of their own
        moved = parts.moved.get("joint_torque", 0.0) + (own * (2.0 * with_links + of_own)).sum(0)
        both, spread = (with_links[1] + of_own[1])[at], parts.spreads[1, 1][at]
        moved, squares = moved[at], parts.squares[1][at]
        tau, qd = out[self.rows["tau"].rows], out[self.rows["qd"].rows][at]
        power = tau**2 * spread + moved * squares + (2.0 * tau * qd + both) * both
        borne = 0.0 if parts.borne is None else np.asarray(parts.borne.joint_torque).T[at]
        return {
            "tau": Variances(moved, moved + borne),
            "power": Variances(power, power + squares * borne),
        }

    def _of(self, name: str, parts: KnownParts) -> Variances:
        """Return the variances of a quantity of `BY_LINK`."""
        known = BY_LINK[name]
        doubled = 4.0 if self.convention == "gradient" and name == "tau_qd" else 1.0
        if known.name in parts.moved:
            own = taken(parts.moved[known.name], self._at(name, known.field), "by motion")
        else:
            own = np.zeros((len(self.rows[name].numbers), 1))
        if doubled != 1.0:
            own *= doubled
        if parts.borne is None:
            return Variances(own, own)
        share = turned(np.asarray(getattr(parts.borne, known.share)), "by bodies")
        whole = taken(share, self._at(name, FIELD_OF_SHARE[known.share]), "by all")
        if known.cause:
            squares = np.ascontiguousarray(parts.squares[ORDERS.index(known.cause)])
            whole *= taken(squares, self.rows[name].at[:, known.axis], "causes")
        if doubled != 1.0:
            whole *= doubled
        whole += own
        return Variances(own, whole)

    def _at(self, name: str, field: str) -> Index:
        """Return the places of a quantity's rows among packed values."""
        return self._places[name, field]

    @cached_property
    def _places(self) -> dict[tuple[str, str], Index]:
        layout, found = self.robot.model.layout, {}
        for name in self.quantities:
            known = BY_LINK.get(name)
            for field in () if known is None else {known.field, FIELD_OF_SHARE[known.share]}:
                place = {tuple(row): at for at, row in enumerate(getattr(layout, field).tolist())}
                if field == "acceleration":  # stored for i up to k alone
                    place |= {(k, j, i): at for (i, j, k), at in place.items()}
                at = [place[tuple(row)] for row in self.rows[name].at.tolist()]
                found[name, field] = np.array(at, np.intp)
        return found
