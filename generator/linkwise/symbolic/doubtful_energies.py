"""Kinetic energies that SymPy takes and that are probably not what was meant."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import sympy as sp
from linkwise_runtime.structure import IMPOSED_MOTION

from linkwise.robot.notes import Note
from linkwise.symbolic.system import LinkTerms
from linkwise.symbolic.written_motion import WrittenMotion

STATICS = (
    "no kinetic energy, so that accelerations load nothing: derivatives by another symbol than that of which "
    "coordinates are functions are 0"
)
STILL = "kinetic energies without any velocity, which count as potential energies do (a derivative missing?)"
NEGATIVE = "kinetic energies that are negative, as that of no body is"
STATES = 8
"""Random states at which the sign of a kinetic energy is looked at, half with numbers above 0 alone."""


def doubts(
    name: str, links: Sequence[LinkTerms], motion: WrittenMotion, values: Mapping[sp.Symbol, sp.Expr]
) -> Iterator[Note]:
    """Yield a note for each link, or for the system, whose kinetic energy is to be looked at again."""
    imposed = [sp.Add(*(s.motion for s in link.shares if s.name == IMPOSED_MOTION)) for link in links]
    if all(link.kinetic == 0 and rest == 0 for link, rest in zip(links, imposed, strict=True)):
        yield Note("doubtful", name, effect=STATICS)
    moving = {*motion.velocities, motion.time}
    for link, rest in zip(links, imposed, strict=True):
        if link.kinetic == 0 and rest != 0 and not rest.free_symbols & moving:
            yield Note("doubtful", link.name, effect=STILL)
        elif link.degree == 2 and link.kinetic != 0 and _is_negative(link.kinetic, motion, values):
            yield Note("doubtful", link.name, effect=NEGATIVE)


def _is_negative(kinetic: sp.Expr, motion: WrittenMotion, values: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Return whether an energy of degree two in the velocities is below zero at all random states.

    At some of them that of a body may be: a chain's length is above zero, which its symbol need not say.
    """
    symbols = [*motion.positions, *motion.velocities, *motion.varying]
    random = np.random.default_rng(0).uniform(-1, 1, (STATES, len(symbols)))
    random[::2] = np.abs(random[::2])
    found = []
    for state in random:
        numbers = dict(zip(symbols, map(sp.Float, state), strict=True))
        energy = kinetic.xreplace({**values, **numbers}).evalf()
        if energy.is_Number and energy.is_finite:
            found.append(float(energy))
    return bool(found) and max(found) < 0.0
