"""Rows of a result that hold standard deviations, where bodies, motion or loads are uncertain.

What bodies do to torques of an open tree, and to their powers, is known exactly from regressors; everything
else by perturbing what is uncertain, see `divided_differences`. All three are independent of each other.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from operator import itemgetter
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from linkwise_runtime.certainty.divided_differences import Direction, variances
from linkwise_runtime.certainty.product_moments import Product, ProductMoments
from linkwise_runtime.certainty.share_variances import ShareVariances, share_variances

from linkwise.analysis.loads.placed import LoadShift
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.perturbed_robots import PerturbedRobots, perturbed_robots
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
FACTOR_OF = dict(zip(MOTION, ("c2", "c1"), strict=True))
"""Names of the factors that stand beside quantities, by the torque that is each times the cause's motion."""


class PerturbedArrays(NamedTuple):
    """Arrays of rows whose variances are found, among those of `Perturbable.values`, and products of them."""

    places: Mapping[str, Some]
    """Rows of each, by quantity or factor."""
    borne: tuple[str, ...]
    """Arrays that bodies perturb."""
    products: Mapping[str, Product]
    """Torques by cause and powers, by quantity."""

    def of(self, values: Array) -> list[Array]:
        """Return all of the arrays, views where rows follow each other."""
        return [values[some] for some in self.places.values()]

    def of_borne(self, values: Array) -> list[Array]:
        """Return the arrays that bodies perturb."""
        return [values[self.places[name]] for name in self.borne]


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
        if self.uncertain.stated is None or not any(name in rows for name in DEVIATION_OF):
            return
        exact = {} if self._exact is None else self._of_bodies(self._exact, plain, motion)
        arrays = self._perturbed(rows, frozenset(exact))
        exact = {name: deviations for name, deviations in exact.items() if name in arrays.places}
        for at in range(0, len(time), AT_ONCE):
            some = slice(at, at + AT_ONCE)
            q, qd, qdd = motion
            bodies = {name: variance[:, some] for name, variance in exact.items()}
            moved, found = self._variances(plain, arrays, time[some], (q[some], qd[some], qdd[some]), bodies)
            for variance, deviations in ((moved, NOISE_OF), (found, DEVIATION_OF)):
                for deviation, quantity in deviations.items():
                    if deviation in rows:
                        out[rows[deviation].rows, some] = np.sqrt(np.maximum(variance[quantity], 0.0))

    def _perturbed(self, rows: ResultRows, exact: frozenset[str]) -> PerturbedArrays:
        """Return what is perturbed; exact: arrays whose variances by bodies are known otherwise."""
        names = [quantity for name, quantity in DEVIATION_OF.items() if name in rows]
        factors, start = {}, rows.plain
        for torque, factor in FACTOR_OF.items():
            factors[factor] = slice(start, start := start + len(rows[torque].numbers))
        made = {name: of for name, of in (FACTOR_OF | TORQUE_OF).items() if name in names}
        bases = [name for name in ("qd", "qdd", *names, *made.values()) if name not in (*made, *factors)]
        places = {name: rows[name].rows for name in dict.fromkeys(bases)} | factors
        borne = () if self.uncertain.bodies is None else {*OF_BODIES, *factors}.intersection(places) - exact
        return PerturbedArrays(places, tuple(sorted(borne)), products(rows, places, made))

    def _variances(
        self,
        plain: Perturbable,
        arrays: PerturbedArrays,
        time: Array,
        motion: Motion,
        exact: Mapping[str, Array],
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return variances by noise of motion, and by all that is uncertain, by quantity.

        exact: variances by bodies that are known
        """
        values = plain.values(time, *motion)
        here = arrays.of(values)
        moments = ProductMoments(tuple(arrays.products.values()), here)
        moved = variances(here, self._moved(plain, time, motion, arrays), moments.add)
        loaded = variances(here, self._loaded(plain, time, motion, arrays))
        found = dict(zip(arrays.places, map(np.add, moved, loaded), strict=True))
        if arrays.borne:
            carried = variances(arrays.of_borne(values), self._carried(plain, time, motion, arrays))
            for name, variance in zip(arrays.borne, carried, strict=True):
                found[name] += variance
        for name, variance in exact.items():
            found[name] += variance
        answers = []
        for some in (moved, list(found.values())):
            every = zip((*arrays.places, *arrays.products), (*some, *moments.variances(some)), strict=True)
            answers.append(dict(every))
        return answers[0], answers[1]

    def _moved(
        self, plain: Perturbable, time: Array, motion: Motion, arrays: PerturbedArrays
    ) -> Iterator[Direction]:
        """Yield the directions of motion."""
        noise = self.uncertain.motion
        moves = () if noise is None else noise.directions(time)
        for number, move in enumerate(moves):

            def rows(size: float, move: Motion = move) -> list[Array]:
                moved = (a + size * d for a, d in zip(motion, move, strict=True))
                return arrays.of(plain.values(time, *moved))

            yield Direction(rows, is_linear=3 * number >= 2 * len(moves))

    def _loaded(
        self, plain: Perturbable, time: Array, motion: Motion, arrays: PerturbedArrays
    ) -> Iterator[Direction]:
        """Yield the directions of loads."""
        for e, spread in enumerate(self.uncertain.loads):
            for shift in () if spread is None else spread.directions():

                def rows(size: float, e: int = e, shift: LoadShift = shift) -> list[Array]:
                    off = LoadShift(*(size * a for a in shift))
                    return arrays.of(plain.with_load_off(e, off).values(time, *motion))

                yield Direction(rows)

    def _carried(
        self, plain: Perturbable, time: Array, motion: Motion, arrays: PerturbedArrays
    ) -> Iterator[Direction]:
        """Yield the directions of bodies, along which arrays are known that they perturb."""
        for off in self._bodies:

            def rows(size: float, off: PerturbedRobots = off) -> list[Array]:
                try:
                    robot = off.ahead if size > 0 else off.behind
                    return arrays.of_borne(plain.with_robot(robot).values(time, *motion))
                except LinkwiseError as error:
                    raise LinkwiseError(
                        f"--uncertain: with a body off by {abs(size):.2g} standard deviations, {error}"
                    ) from error

            yield Direction(rows, off.width)

    def _of_bodies(self, exact: ShareVariances, plain: Perturbable, motion: Motion) -> dict[str, Array]:
        """Return variances by bodies of an open tree, (rows, S), by array."""
        _, at = self.robot.model.door.read(dict(zip(("q", "qd", "qdd"), motion, strict=True)))
        found: Any = exact.packed(at, with_sums=False)
        c2, c1, gravity, torque, whole = (np.asarray(a) for a in found[:5])
        twice = 4.0 if self.convention == "gradient" else 1.0
        sources = self.sources
        return {
            "tau": whole[:, plain.rows["tau"].at[:, 0]].T,
            "tau_link": torque[:, sources.torque].T,
            "tau_gravity": gravity[:, sources.gravity].T,
            "c2": c2[:, sources.acceleration].T,
            "c1": twice * c1[:, sources.velocity].T,
        }


def products(rows: ResultRows, places: Iterable[str], made: Mapping[str, str]) -> dict[str, Product]:
    """Return the products of a result, by quantity, as of arrays and then of products before.

    places: names of the arrays; made: the torque or factor that each product is of
    """
    at = {name: number for number, name in enumerate((*places, *made))}
    found = {}
    for name, of in made.items():
        motion, axis = ("qdd" if name == "tau_qdd" else "qd"), (2 if name in MOTION else 0)
        second = partial(_rows, at[motion], rows[name].at[:, axis])
        found[name] = Product(itemgetter(at[of]), second, is_factor=name in made.values())
    return found


def _rows(number: int, of: Index, arrays: Sequence[Any]) -> Array:
    """Return rows of one of the arrays."""
    found: Array = arrays[number][of]
    return found
