"""Constraints as a user writes them in SymPy, checked: phi(q) = 0, or a sum A(q) qd = 0 of velocities."""

import random
from collections.abc import Callable, Mapping

import sympy as sp

from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.symbolic.energy_terms import expression_of
from linkwise.symbolic.jumps import jump
from linkwise.symbolic.system import WrittenConstraint
from linkwise.symbolic.written_motion import WrittenMotion

PLACES = 4
DIGITS = 50
"""Places and digits by which an expression is found to be zero."""


def written_constraints(
    given: object,
    motion: WrittenMotion,
    read: Callable[[sp.Expr], sp.Expr],
    numbers: Mapping[sp.Symbol, sp.Expr],
) -> tuple[WrittenConstraint, ...]:
    """Return the constraints, whose expressions `read` checks for symbols that nobody knows.

    given: expressions that are zero, or equations, by name; numbers: values of parameters

    Raises LinkwiseError for what is none of that, for time and inputs, for what jumps, and for velocities
    that do not stand there linearly and alone.
    """
    if not isinstance(given, Mapping):
        raise LinkwiseError(
            f"`constraints` is {short(repr(given))}; give a dictionary of expressions that are zero, by name"
        )
    found = []
    for name, expression in given.items():
        if not isinstance(name, str) or not name.strip() or not name.isprintable() or name != name.strip():
            raise LinkwiseError(f"a constraint is called {short(repr(name))}; give it a name in quotes")
        with within(f"constraint {name!r}"):
            if isinstance(expression, sp.Equality):
                expression = expression.lhs - expression.rhs
            zero = read(motion.plain(expression_of("expression", expression)))
            found.append(_checked(name, zero, motion, numbers))
    return tuple(found)


def _checked(
    name: str, zero: sp.Expr, motion: WrittenMotion, numbers: Mapping[sp.Symbol, sp.Expr]
) -> WrittenConstraint:
    for symbol in motion.varying:
        if zero.has(symbol):
            what = "time" if symbol == motion.time else "an input"
            raise LinkwiseError(
                f"it depends on {symbol}, which is {what}; constraints that move are not modelled: write a "
                "motion that is imposed into the energies, as coordinates that are functions of time"
            )
    if not zero.has(*motion.positions, *motion.velocities):
        raise LinkwiseError("it depends on no coordinate: it holds always or never; leave it out")
    if (where := jump(zero.xreplace(dict(numbers)))) is not None:
        raise LinkwiseError(f"it jumps where {short(str(where))} passes zero; join the pieces")
    velocities = motion.velocities
    rest = zero.xreplace(dict.fromkeys(velocities, sp.S.Zero))
    if not zero.has(*velocities) or all(_vanishes(sp.diff(zero, v)) for v in velocities):
        found = WrittenConstraint(name, rest, holonomic=True)
    else:
        bends = (sp.diff(zero, v, w) for v in velocities for w in velocities)
        linear = all(_vanishes(bend) for bend in bends)
        if not linear or not _vanishes(rest):
            beside = "has terms without velocities beside those with" if linear else "is not linear in them"
            raise LinkwiseError(
                f"it has velocities, and {beside}; what is modelled is a sum of velocities, each times a "
                "function of the coordinates, or an expression of coordinates alone"
            )
        found = WrittenConstraint(name, zero if rest == 0 else sp.expand(zero - rest), holonomic=False)
    if all(_vanishes(entry) for entry in found.row(motion.coordinates)):
        raise LinkwiseError("no motion changes it: it holds always or never; leave it out")
    return found


def _vanishes(expression: sp.Expr) -> bool:
    """Return whether an expression is zero, as sin² + cos² - 1 is: at some places, to thirty digits."""
    if expression == 0:
        return True
    if expression.has(sp.Piecewise, sp.Abs, sp.Max, sp.Min, sp.sign):
        return False  # what is zero at some places need not be at others
    symbols, draw = sorted(expression.free_symbols, key=str), random.Random(0)
    for _ in range(PLACES):
        at = {symbol: sp.Float(draw.uniform(0.3, 1.7), DIGITS) for symbol in symbols}
        value = expression.subs(at).evalf(DIGITS)
        if not value.is_number or value.is_comparable is False or abs(value) > sp.Float(10) ** -(DIGITS // 2):
            return False
    return True
