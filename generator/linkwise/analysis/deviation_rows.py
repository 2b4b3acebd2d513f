"""Rows of a result that hold standard deviations, where bodies, motion or loads are uncertain.

What bodies do to torques of an open tree, and to their powers, is known exactly from regressors; everything
else by perturbing what is uncertain, see `divided_differences`. All three are independent of each other.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from linkwise_runtime.certainty.divided_differences import Direction, variances
from linkwise_runtime.certainty.share_deviations import ShareDeviations, share_deviations

from linkwise.analysis.loads.placed import LoadShift
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.perturbed_robots import PerturbedRobots, perturbed_robots
from linkwise.analysis.product_rows import PairedDirections, ProductRows
from linkwise.analysis.result_quantities import DEVIATION_OF, MOTION, NOISE_OF, OF_BODIES, OF_LOADS, TORQUE_OF
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.settings import Convention
from linkwise.analysis.stated_bodies import is_closed_form
from linkwise.analysis.term_rows import TermArrays
from linkwise.analysis.uncertain_inputs import UncertainInputs
from linkwise.arrays import Array, Index
from linkwise.errors import LinkwiseError

AT_ONCE = 256
"""Samples perturbed at once, whose rows stay in the cache."""
Motion = tuple[Array, Array, Array]
"""q, qd and qdd, (S, n) each."""


class Perturbable(Protocol):
    """Decomposition whose rows are perturbed."""

    @property
    def rows(self) -> ResultRows:
        """Rows of the result."""

    def values(self, time: Array, q: Array, qd: Array, qdd: Array) -> Array:
        """Return all rows but those of deviations, then c2 and c1 of rows tau_qdd and tau_qd, (rows, S)."""

    def with_robot(self, robot: OpenedRobot) -> Self:
        """Return the decomposition of another robot of the same joints and links."""

    def with_load_off(self, e: int, shift: LoadShift) -> Self:
        """Return the decomposition in which load e is off by a shift."""


Some = slice | Index
"""Rows, as a slice where they follow each other."""
FACTORS = "factors"
"""Name under which the factors c2 and c1 of torques by cause stand beside quantities."""


class PerturbedRows(NamedTuple):
    """Rows whose variances are found, among those of `Perturbable.values`."""

    of: Some
    borne: Index
    """Rows that bodies perturb."""
    left: Array
    """True for each row that bodies perturb, (rows,)."""
    places: Mapping[str, slice]
    """Places of each quantity, and of the factors, among them."""
    products: ProductRows | None
    """Products of what is uncertain; None where motion is not."""


@dataclass(frozen=True)
class DeviationRows:
    """Fills the rows of deviations; none where nothing is uncertain."""

    robot: OpenedRobot
    uncertain: UncertainInputs
    convention: Convention
    sources: TermArrays
    """Places of the rows of τ_ij and its terms among packed values, in the order of rows."""

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

    @cached_property
    def _exact(self) -> ShareDeviations | None:
        """Deviations of the shares of an open tree by its bodies, packed."""
        given, robot = self.uncertain.bodies, self.robot
        if given is None or not is_closed_form(robot):
            return None
        return share_deviations(robot.model.backend, given)

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
        names = [name for name in DEVIATION_OF if name in rows]
        if not names:
            return
        into, apart = rows.numbers(*names), rows.numbers(*(name for name in NOISE_OF if name in rows))
        exact = {} if self._exact is None else self._of_bodies(self._exact, plain, motion)
        every = self._perturbed(rows, [DEVIATION_OF[name] for name in names], frozenset(exact))
        for at in range(0, len(time), AT_ONCE):
            some = slice(at, at + AT_ONCE)
            q, qd, qdd = motion
            moved, found, pairs = self._variances(plain, every, time[some], (q[some], qd[some], qdd[some]))
            for name, deviations in exact.items():
                found[every.places[name]] += deviations[:, some] ** 2
            for variance, numbers in ((moved, apart), (found, into)):
                if pairs is not None and len(numbers):
                    pairs.widen(variance)
                out[numbers, some] = np.sqrt(variance[: len(numbers)])

    def _perturbed(self, rows: ResultRows, names: Sequence[str], exact: frozenset[str]) -> "PerturbedRows":
        """Return the rows of these quantities, then the factors of torques by cause.

        exact: quantities whose variances by bodies are known otherwise
        """
        count = sum(len(rows[name].numbers) for name in MOTION)
        numbers = [*(rows[name].numbers for name in names), rows.plain + np.arange(count)]
        ends = np.cumsum([len(some) for some in numbers])
        spans = [slice(end - len(some), end) for end, some in zip(ends.tolist(), numbers, strict=True)]
        places, every = dict(zip((*names, FACTORS), spans, strict=True)), np.concatenate(numbers)
        left = np.zeros(len(every), bool)
        if self.uncertain.bodies is not None:
            for name in (OF_BODIES | {FACTORS}).difference(exact).intersection(places):
                left[places[name]] = True
        products = None if self.uncertain.motion is None else ProductRows.of(rows, places, FACTORS)
        return PerturbedRows(together(every), every[left], left, places, products)

    def _variances(
        self, plain: Perturbable, every: "PerturbedRows", time: Array, motion: Motion
    ) -> tuple[Array, Array, PairedDirections | None]:
        """Return variances of rows by noise of motion, by all that is perturbed, and pairs of directions."""
        given, of = self.uncertain, every.of
        pairs = None if every.products is None else PairedDirections(every.products, len(time))
        if given.motion is None and not any(given.loads) and not len(every.borne):
            found = np.zeros((len(every.left), len(time)))
            return found, found, pairs
        values = plain.values(time, *motion)[of]
        note = None if pairs is None else pairs.add
        [moved] = variances([values], self._moved(plain, time, motion, of), note)
        found = moved + variances([values], self._loaded(plain, time, motion, of))[0]
        if len(every.borne):
            carried = self._carried(plain, time, motion, every.borne)
            found[every.left] += variances([values[every.left]], carried)[0]
        return moved, found, pairs

    def _moved(self, plain: Perturbable, time: Array, motion: Motion, of: Some) -> Iterator[Direction]:
        """Yield the directions of motion, along which rows `of` are known."""
        noise = self.uncertain.motion
        moves = () if noise is None else noise.directions(time)
        for number, move in enumerate(moves):

            def rows(size: float, move: Motion = move) -> list[Array]:
                return [plain.values(time, *(a + size * d for a, d in zip(motion, move, strict=True)))[of]]

            yield Direction(rows, is_linear=3 * number >= 2 * len(moves))

    def _loaded(self, plain: Perturbable, time: Array, motion: Motion, of: Some) -> Iterator[Direction]:
        """Yield the directions of loads."""
        for e, spread in enumerate(self.uncertain.loads):
            for shift in () if spread is None else spread.directions():

                def rows(size: float, e: int = e, shift: LoadShift = shift) -> list[Array]:
                    off = LoadShift(*(size * a for a in shift))
                    return [plain.with_load_off(e, off).values(time, *motion)[of]]

                yield Direction(rows)

    def _carried(self, plain: Perturbable, time: Array, motion: Motion, of: Some) -> Iterator[Direction]:
        """Yield the directions of bodies."""
        for off in self._bodies:

            def rows(size: float, off: PerturbedRobots = off) -> list[Array]:
                try:
                    robot = off.ahead if size > 0 else off.behind
                    return [plain.with_robot(robot).values(time, *motion)[of]]
                except LinkwiseError as error:
                    raise LinkwiseError(
                        f"--uncertain: with a body off by {abs(size):.2g} standard deviations, {error}"
                    ) from error

            yield Direction(rows, off.width)

    def _of_bodies(self, exact: ShareDeviations, plain: Perturbable, motion: Motion) -> dict[str, Array]:
        """Return deviations by bodies of an open tree, (rows, S), by the quantity that they are of."""
        rows, (_, qd, qdd) = plain.rows, motion
        _, at = self.robot.model.door.read(dict(zip(("q", "qd", "qdd"), motion, strict=True)))
        found: Any = exact.packed(at, with_sums=False)
        c2, c1, gravity, torque, whole = (np.asarray(a) for a in found[:5])
        twice = 2.0 if self.convention == "gradient" else 1.0
        answers = {"tau": whole[:, rows["tau"].at[:, 0]].T}
        sources = self.sources
        factors = [c2[:, sources.acceleration].T, twice * c1[:, sources.velocity].T]
        for name, values, moves in zip(MOTION, factors, (qdd, qd), strict=True):
            answers[name] = values * np.abs(moves[:, rows[name].at[:, 2]]).T
        answers["tau_link"] = torque[:, sources.torque].T
        answers["tau_gravity"] = gravity[:, sources.gravity].T
        answers[FACTORS] = np.concatenate(factors)
        for power, of in TORQUE_OF.items():
            if of in answers and power in rows:
                answers[power] = answers[of] * np.abs(qd[:, rows[power].at[:, 0]]).T
        return answers


def together(numbers: Index) -> Some:
    """Return rows as a slice where they follow each other."""
    if len(numbers) and (np.diff(numbers) == 1).all():
        return slice(int(numbers[0]), int(numbers[-1]) + 1)
    return numbers
