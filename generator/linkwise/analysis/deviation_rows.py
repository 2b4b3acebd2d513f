"""Rows of a result that hold standard deviations, where bodies, motion or loads are uncertain.

What bodies do to torques of an open tree, and to their powers, is known exactly from regressors, and compiled
code knows what noise of the motion does; everything else by perturbing what is uncertain.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from linkwise_runtime.certainty.share_variances import PackedVariances, ShareVariances, share_variances

from linkwise.analysis.known_deviations import (
    BY_LINK,
    OF_JOINTS,
    ORDERS,
    KnownDeviations,
    Motion,
    Variances,
)
from linkwise.analysis.net_causes import NET
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.perturbed_robots import PerturbedRobots, perturbed_robots
from linkwise.analysis.perturbed_rows import Perturbable, PerturbedArrays, PerturbedRows
from linkwise.analysis.result_quantities import DEVIATION_OF, NOISE_OF, OF_BODIES, OF_LOADS, PASSIVE
from linkwise.analysis.result_rows import DEVIATION, OF_MOTION, Place, ResultRows
from linkwise.analysis.settings import Convention
from linkwise.analysis.stated_bodies import is_closed_form
from linkwise.analysis.term_rows import TermArrays
from linkwise.analysis.uncertain_inputs import UncertainInputs
from linkwise.arrays import Array, Index

AT_ONCE = 256
"""Samples perturbed at once, whose rows stay in the cache."""
FEW = ("tau", *PASSIVE, "tau_load", "power", "power_load", NET)
"""Quantities that are perturbed where they are not known, as with friction or loads: they are few."""


@dataclass(frozen=True)
class DeviationRows:
    """Fills the rows of deviations; none where nothing is uncertain."""

    robot: OpenedRobot
    uncertain: UncertainInputs
    convention: Convention
    sources: TermArrays
    """Places of the rows of τ_ij and its terms among packed values, in the order of rows."""
    known: KnownDeviations | None = None
    """Deviations of rows by link that are known; None where all are perturbed."""
    few: tuple[int, ...] = ()
    """Rows that are perturbed beside those, and what these are made of."""

    def places(self, others: Sequence[Place]) -> Iterator[Place]:
        """Yield the place of a deviation for each of these rows that has one, then of its part by motion."""
        wanted, given = self._wanted, self.uncertain
        apart = given.motion is not None and not given.is_of_motion_alone
        for of in (DEVIATION_OF, NOISE_OF) if apart else (DEVIATION_OF,):
            for deviation, quantity in of.items():
                if quantity in wanted:
                    yield from ((deviation, at) for name, at in others if name == quantity)

    @property
    def _wanted(self) -> frozenset[str]:
        """Quantities that what is uncertain makes uncertain."""
        given, every = self.uncertain, frozenset(DEVIATION_OF.values())
        if given.motion is not None:
            return every
        found = OF_BODIES if given.bodies is not None else frozenset()
        return found | (OF_LOADS if any(given.loads) else frozenset())

    def of_rows(self, rows: ResultRows) -> Self:
        """Return this with a plan for the rows of a result: what is known, and what is to be perturbed."""
        names, given = _names(rows), self.uncertain
        coded = given.motion is None or self.robot.backend == "native"
        if not names or not coded or not is_closed_form(self.robot) or {*names} - {*ORDERS, *BY_LINK, *FEW}:
            return self
        linear = not self.robot.with_own("friction") and "tau_load" not in rows and "tau" in rows
        quantities = {*ORDERS, *BY_LINK, *(OF_JOINTS if linear else ())}
        known = KnownDeviations(
            *(self.robot, self.convention, rows, tuple(name for name in names if name in quantities)),
            *(self._exact, given.motion),
        )
        left = [name for name in FEW if name not in quantities]
        few = rows.numbers("time", "qd", "qdd", *left).tolist() if {*names} - quantities else []
        return replace(self, known=known, few=tuple(few))

    @property
    def is_quick(self) -> bool:
        """True if compiled code finds nearly all deviations."""
        return self.uncertain.stated is None or (self.known is not None and self.robot.backend == "native")

    @cached_property
    def _exact(self) -> ShareVariances | None:
        """Variances of the shares of an open tree by its bodies, packed."""
        given, robot = self.uncertain.bodies, self.robot
        if given is None or not is_closed_form(robot):
            return None
        return share_variances(robot.model.backend, given)

    @cached_property
    def _bodies(self) -> Sequence[PerturbedRobots]:
        """Robots whose bodies are off, one way and the other."""
        given = self.uncertain.bodies
        return () if given is None else perturbed_robots(self.robot, given)

    def fill(self, out: Array, plain: Perturbable, time: Array, motion: Motion) -> None:
        """Fill the rows of deviations in `out` (rows, S), whose other rows are filled.

        motion: q, qd and qdd (S, n) in which ties close
        """
        rows = plain.rows
        if self.uncertain.stated is None or not _names(rows):
            return
        find = self._perturbed if self.known is None else self._known
        for at in range(0, len(time), AT_ONCE):
            some = slice(at, at + AT_ONCE)
            q, qd, qdd = motion
            for name, found in find(out[:, some], plain, time[some], (q[some], qd[some], qdd[some])):
                for beginning, variance in ((OF_MOTION, found.moved), (DEVIATION, found.every)):
                    if f"{beginning}{name}" in rows:
                        _put_roots(variance, out, rows[f"{beginning}{name}"].rows, some)

    def _known(
        self, out: Array, plain: Perturbable, time: Array, motion: Motion
    ) -> Iterator[tuple[str, Variances]]:
        """Yield variances by quantity where those of most rows are known."""
        assert self.known is not None  # as `fill` has seen
        parts = self.known.parts(time, motion)
        yield from self.known.find(out, parts)
        if not self.few:
            return
        few = plain.with_rows([plain.rows.places[row] for row in self.few])
        exact = {} if parts.borne is None else {"tau": _of_joints(parts.borne, few.rows)}
        names = [name for name in _names(plain.rows) if name in FEW and name in few.rows]
        yield from self._varied(few, names, exact, out[list(self.few)], time, motion)

    def _perturbed(
        self, _out: Array, plain: Perturbable, time: Array, motion: Motion
    ) -> Iterator[tuple[str, Variances]]:
        """Yield variances by quantity where all rows are perturbed."""
        exact: dict[str, Array] = {}
        if self._exact is not None:
            _, at = self.robot.model.door.read(dict(zip(ORDERS, motion, strict=True)))
            exact = self._of_links(self._exact.packed(at, with_sums=False), plain.rows)
        values = plain.values(time, *motion)
        yield from self._varied(plain, _names(plain.rows), exact, values, time, motion)

    def _varied(
        self,
        plain: Perturbable,
        names: Sequence[str],
        exact: Mapping[str, Array],
        values: Array,
        time: Array,
        motion: Motion,
    ) -> Iterator[tuple[str, Variances]]:
        """Yield variances of the quantities with these names by perturbing rows.

        exact: variances by bodies that are known; values: the rows, and what stands behind them
        """
        are_bodies = self.uncertain.bodies is not None
        arrays = PerturbedArrays.among(plain.rows, names, are_bodies, frozenset(exact))
        known = {name: variance for name, variance in exact.items() if name in arrays.places}
        bodies = self._bodies if arrays.borne else ()
        return PerturbedRows(self.uncertain, bodies, plain, arrays, time, motion).variances(values, known)

    def _of_links(self, found: PackedVariances, rows: ResultRows) -> dict[str, Array]:
        """Return variances by bodies of an open tree, (rows, S), by array."""
        c2, c1, gravity, torque = (np.asarray(a) for a in found[:4])
        twice = 4.0 if self.convention == "gradient" else 1.0
        sources = self.sources
        return {
            "tau": _of_joints(found, rows),
            "tau_link": torque[:, sources.torque].T,
            "tau_gravity": gravity[:, sources.gravity].T,
            "c2": c2[:, sources.acceleration].T,
            "c1": twice * c1[:, sources.velocity].T,
        }


def _put_roots(variance: Array, out: Array, at: slice | Index, some: slice) -> None:
    """Fill rows with roots, in place where rows follow each other: fresh memory costs more than roots."""
    if isinstance(at, slice):
        found = out[at, some]
        np.sqrt(np.maximum(variance, 0.0, out=found), out=found)
    else:
        out[at, some] = np.sqrt(np.maximum(variance, 0.0))


def _names(rows: ResultRows) -> list[str]:
    """Return the quantities that have deviations among rows."""
    return [quantity for name, quantity in DEVIATION_OF.items() if name in rows]


def _of_joints(found: PackedVariances, rows: ResultRows) -> Array:
    """Return variances of joint torques by bodies, (rows, S)."""
    whole: Array = np.asarray(found.joint_torque)[:, rows["tau"].at[:, 0]].T
    return whole
