"""Variances of rows of a result by perturbing what is uncertain: motion, loads and bodies, one by one.

See `divided_differences`. All three are independent of each other.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from linkwise_runtime.certainty.divided_differences import Direction, variances
from linkwise_runtime.certainty.product_moments import Product, ProductMoments

from linkwise.analysis.known_deviations import Motion, Variances
from linkwise.analysis.loads.placed import LoadShift
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.perturbed_robots import PerturbedRobots
from linkwise.analysis.result_quantities import MOTION, OF_BODIES, TORQUE_OF
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.uncertain_inputs import UncertainInputs
from linkwise.arrays import Array, Index
from linkwise.errors import LinkwiseError


class Perturbable(Protocol):
    """Decomposition whose rows are perturbed."""

    @property
    def rows(self) -> ResultRows:
        """Rows of the result."""

    def values(self, time: Array, q: Array, qd: Array, qdd: Array) -> Array:
        """Return all rows but those of deviations, then c2 and c1 of rows tau_qdd and tau_qd, (rows, S)."""

    def with_rows(self, places: Sequence[Place]) -> Self:
        """Return the decomposition of these rows alone, of which none is a share by link or cause."""

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

    @classmethod
    def among(
        cls, rows: ResultRows, names: Sequence[str], are_bodies: bool, exact: frozenset[str]
    ) -> "PerturbedArrays":
        """Return what is perturbed of the quantities with these names.

        are_bodies: whether bodies are uncertain; exact: arrays whose variances by bodies are known otherwise
        """
        factors, start = {}, rows.plain
        for torque, factor in FACTOR_OF.items():
            if torque in rows:
                factors[factor] = slice(start, start := start + len(rows[torque].numbers))
        made = {name: of for name, of in (FACTOR_OF | TORQUE_OF).items() if name in names}
        bases = [name for name in ("qd", "qdd", *names, *made.values()) if name not in (*made, *factors)]
        places = {name: rows[name].rows for name in dict.fromkeys(bases)} | factors
        borne = {*OF_BODIES, *factors}.intersection(places) - exact if are_bodies else ()
        return cls(places, tuple(sorted(borne)), products(rows, places, made))

    def of(self, values: Array) -> list[Array]:
        """Return all of the arrays, views where rows follow each other."""
        return [values[some] for some in self.places.values()]

    def of_borne(self, values: Array) -> list[Array]:
        """Return the arrays that bodies perturb."""
        return [values[self.places[name]] for name in self.borne]


@dataclass(frozen=True)
class PerturbedRows:
    """Perturbs the rows of a decomposition at some samples."""

    uncertain: UncertainInputs
    bodies: Sequence[PerturbedRobots]
    """Robots whose bodies are off, one way and the other."""
    plain: Perturbable
    arrays: PerturbedArrays
    time: Array
    motion: Motion

    def variances(self, values: Array, exact: Mapping[str, Array]) -> Iterator[tuple[str, Variances]]:
        """Yield the variances of arrays and products by their names.

        values: the decomposition's own, as of `Perturbable.values`; exact: variances by bodies that are known
        """
        arrays = self.arrays
        here = arrays.of(values)
        moments = ProductMoments(tuple(arrays.products.values()), here)
        moved = variances(here, self._moved(), moments.add)
        loaded = variances(here, self._loaded())
        found = dict(zip(arrays.places, map(np.add, moved, loaded), strict=True))
        if arrays.borne:
            carried = variances(arrays.of_borne(values), self._carried())
            for name, variance in zip(arrays.borne, carried, strict=True):
                found[name] += variance
        for name, variance in exact.items():
            found[name] += variance
        every = list(found.values())
        pairs = zip((*moved, *moments.variances(moved)), (*every, *moments.variances(every)), strict=True)
        yield from zip((*arrays.places, *arrays.products), map(Variances._make, pairs), strict=True)

    def _moved(self) -> Iterator[Direction]:
        """Yield the directions of motion."""
        noise = self.uncertain.motion
        moves = () if noise is None else noise.directions(self.time)
        for number, move in enumerate(moves):

            def rows(size: float, move: Motion = move) -> list[Array]:
                moved = (a + size * d for a, d in zip(self.motion, move, strict=True))
                return self.arrays.of(self.plain.values(self.time, *moved))

            yield Direction(rows, is_linear=3 * number >= 2 * len(moves))

    def _loaded(self) -> Iterator[Direction]:
        """Yield the directions of loads."""
        for e, spread in enumerate(self.uncertain.loads):
            for shift in () if spread is None else spread.directions():

                def rows(size: float, e: int = e, shift: LoadShift = shift) -> list[Array]:
                    off = LoadShift(*(size * a for a in shift))
                    return self.arrays.of(self.plain.with_load_off(e, off).values(self.time, *self.motion))

                yield Direction(rows)

    def _carried(self) -> Iterator[Direction]:
        """Yield the directions of bodies, along which arrays are known that they perturb."""
        for off in self.bodies:

            def rows(size: float, off: PerturbedRobots = off) -> list[Array]:
                try:
                    robot = off.ahead if size > 0 else off.behind
                    other = self.plain.with_robot(robot)
                    return self.arrays.of_borne(other.values(self.time, *self.motion))
                except LinkwiseError as error:
                    raise LinkwiseError(
                        f"--uncertain: with a body off by {abs(size):.2g} standard deviations, {error}"
                    ) from error

            yield Direction(rows, off.width)


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
