"""Systems whose link energies a user writes in SymPy."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from sys import float_info
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, short
from linkwise.robot.coordinates import check_joints
from linkwise.robot.robot import Coordinate, unusable
from linkwise.symbolic.doubtful_energies import doubts
from linkwise.symbolic.energy_terms import GivenTerms, sorted_terms, symbols_of, written_terms
from linkwise.symbolic.moving_bodies import BODIES, Particle, RigidBody
from linkwise.symbolic.system import EnergySystem, LinkEnergy, LinkTerms, WrittenConstraint
from linkwise.symbolic.written_constraints import written_constraints
from linkwise.symbolic.written_motion import WrittenMotion


def energy_system(
    name: str,
    coordinates: Sequence[Coordinate] | Mapping[sp.Expr, str],
    links: Sequence[LinkEnergy | Particle | RigidBody],
    parameters: Mapping[sp.Symbol, float] | None = None,
    symbolic: bool = False,
    time: sp.Symbol | None = None,
    inputs: Sequence[sp.Expr] = (),
    constraints: Mapping[str, sp.Expr | sp.Equality] | None = None,
    independent: Sequence[Any] = (),
) -> EnergySystem:
    """Return the system of links that a user wrote, checked: every symbol known, every expression usable.

    coordinates: `Coordinate` of each, whose symbols energies use; or functions of time, as of
    sympy.physics.mechanics.dynamicsymbols, with their units, {theta: "rad"}
    parameters: the value of each other symbol; they become numbers unless `symbolic`, and those that no
    expression has are left out
    time: the symbol of time, where expressions depend on it; that of coordinates given as functions is known
    inputs: symbols or functions of what is given from outside, which forces and dissipation may depend on
    constraints: by name what is zero: an expression of coordinates, or a sum of velocities each times one, as
    of what rolls; or equations
    independent: coordinates that all others follow by the constraints, with their symbols or names; unless
    given, they are chosen where the constraints hold

    Time and inputs are run-time parameters, with the value 0 unless another is given. Raises LinkwiseError
    naming the link, and for more coordinates than can be generated.
    """
    motion = WrittenMotion(coordinates, time, inputs)
    if not isinstance(links, list | tuple) or not all(isinstance(k, (LinkEnergy, *BODIES)) for k in links):
        kinds = " and ".join(f"linkwise.{kind.__name__}" for kind in BODIES)
        raise LinkwiseError(f"`links` is {short(repr(links))}; give a list of linkwise.LinkEnergy, {kinds}")
    links = tuple(links)
    check_joints(len(motion.coordinates), "leave some out")
    _check_names(name, motion.coordinates, links)
    motion.check_apart()
    values = _values(parameters or {}, motion)
    checked, used, moving = [], set[sp.Symbol](), False
    for link in links:
        with within(f"link {link.name!r}"):
            written = link.energies(motion.rate, values) if isinstance(link, BODIES) else link
            terms = written_terms(written, motion)
            found = _checked(link.name, terms, motion, values, symbolic)
            used |= symbols_of(terms.all())
            moving |= terms.kinetic != 0
            checked.append(found)
    for symbol in motion.inputs:
        if symbol not in used:
            raise LinkwiseError(f"the input {symbol} is in no force and no dissipation; leave it out")
    numbers = {symbol: sp.Float(value, 17) for symbol, value in values.items()}
    held = written_constraints(
        constraints or {}, motion, lambda zero: _known(_whole(zero), motion, values, symbolic), numbers
    )
    if moving:  # torques of statics may be all that is asked for
        _check_moved(motion, checked, held)
    used |= {symbol for one in held for symbol in one.expression.free_symbols}
    kept = {symbol: value for symbol, value in values.items() if symbolic and symbol in used}
    varying = {symbol: value for symbol, value in motion.varying.items() if symbol in used}
    request = {"parameters": "symbolic" if symbolic else "numeric"}
    return EnergySystem(
        name,
        motion.coordinates,
        tuple(checked),
        kept | varying,
        request=request,
        time=motion.time if motion.time in varying else None,
        inputs=tuple(symbol for symbol in motion.inputs if symbol in varying),
        notes=tuple(doubts(name, checked, motion, numbers)),
        constraints=held,
        requested_independent=_requested(independent, motion, bool(held)),
    )


def _requested(given: Sequence[Any], motion: WrittenMotion, held: bool) -> tuple[int, ...]:
    """Return the indices of the coordinates that were asked for; raises LinkwiseError."""
    if not isinstance(given, list | tuple):
        raise LinkwiseError(f"`independent` is {short(repr(given))}; give a list of coordinates")
    if given and not held:
        raise LinkwiseError("`independent` is for constraints, and there are none; leave it out")
    found = sorted(motion.index(one, "`independent` names") for one in given)
    if len(set(found)) < len(found):
        raise LinkwiseError("`independent` names a coordinate twice")
    return tuple(found)


def _check_names(name: str, coordinates: tuple[Coordinate, ...], links: tuple[Any, ...]) -> None:
    if not isinstance(name, str):
        raise LinkwiseError(f"`name` is {name!r}; give the robot's name, a string")
    for what, items in (("coordinates", coordinates), ("links", links)):
        if not items:
            raise LinkwiseError(f"`{what}` is empty; give at least one")
    for what, names in (
        ("coordinate", [c.name for c in coordinates]),
        ("link", [k.name for k in links]),
    ):
        for item in names:
            if not isinstance(item, str):
                raise LinkwiseError(f"the {what} name {item!r} is not a string; put it in quotes")
            if not item.strip() or names.count(item) > 1:
                fault = "is used twice" if item.strip() else "is empty"
                raise LinkwiseError(f"the {what} name {item!r} {fault}; give each its own")
    for coordinate in coordinates:
        if coordinate.unit not in ("rad", "m"):
            raise LinkwiseError(
                f"coordinate {coordinate.name!r} has the unit {coordinate.unit!r}; give rad or m"
            )


def _values(parameters: Mapping[sp.Symbol, float], motion: WrittenMotion) -> dict[sp.Symbol, float]:
    """Return the parameters with float values; one symbol a name, as generated code knows names only."""
    if not isinstance(parameters, Mapping) or not all(isinstance(s, sp.Symbol) for s in parameters):
        raise LinkwiseError("`parameters` must be a dictionary of SymPy symbols and their values")
    for symbol in parameters:
        if symbol in motion.varying:
            raise LinkwiseError(
                f"parameter {symbol} is time or an input too; leave it out of `parameters`: its value is "
                "given at run time"
            )
    for name, count in Counter(symbol.name for symbol in (*parameters, *motion.varying)).items():
        if count > 1:
            raise LinkwiseError(
                f"the parameters called {name} are {count} different symbols, told apart by their "
                "assumptions only; rename all but one"
            )
    values = {}
    for symbol, value in parameters.items():
        if symbol in {*motion.positions, *motion.velocities}:
            raise LinkwiseError(f"parameter {symbol} is a coordinate or its velocity too; rename one")
        if isinstance(value, (str, bytes, bool)):
            raise LinkwiseError(f"parameter {symbol} is {short(repr(value))}; give a number, without quotes")
        if isinstance(value, sp.Basic) and (varying := value.atoms(AppliedUndef) or value.free_symbols):
            raise LinkwiseError(_not_constant(symbol, value, varying, motion))
        try:
            values[symbol] = float(value)
        except (TypeError, ValueError, OverflowError):
            raise LinkwiseError(f"parameter {symbol} has no value as a real number; give one") from None
        if fault := unusable(values[symbol]):
            raise LinkwiseError(f"parameter {symbol} has {fault} for a value; give a number")
    return values


def _not_constant(symbol: sp.Symbol, value: sp.Basic, varying: Iterable[Any], motion: WrittenMotion) -> str:
    """Return how to mend a parameter whose value depends on something."""
    what = listed(f"time {one}" if one == motion.time else one for one in sorted(varying, key=str))
    return (
        f"parameter {symbol} is a constant, and its value {short(str(value))} depends on {what}; write that "
        f"in the energies in place of {symbol}, `time` being the symbol of time, or make {symbol} an input"
    )


def _check_moved(
    motion: WrittenMotion, links: Iterable[LinkTerms], constraints: Iterable[WrittenConstraint]
) -> None:
    """Raise LinkwiseError for a coordinate without velocity.

    A damper, a magnet, or a constraint may tell the motion or the torque of one without a kinetic energy.
    """
    parts = [
        part
        for link in links
        for part in (link.kinetic, *(p for share in link.shares for p in share.parts()))
    ]
    held = [one.expression for one in constraints]
    for c in motion.coordinates:
        if not any(part.has(c.qd) for part in parts) and not any(zero.has(c.q, c.qd) for zero in held):
            raise LinkwiseError(
                f"coordinate {c.name!r} is without velocity: no kinetic energy has it (a mass of zero gives "
                "none), no dissipation, force or constraint, so that no acceleration follows from its "
                "torque; give what it moves a mass, or leave it out"
            )


def _checked(
    name: str, terms: GivenTerms, motion: WrittenMotion, values: dict[sp.Symbol, float], symbolic: bool
) -> LinkTerms:
    terms = terms.mapped(_whole)
    _check_known(symbols_of(terms.all()), motion, values)
    numbers = {symbol: sp.Float(value, 17) for symbol, value in values.items()}
    plain = terms.mapped(lambda expr: _whole(expr.xreplace(numbers)))
    _check_real(*(expr for _, expr in (*terms.all(), *plain.all())))
    none_given = dict.fromkeys(motion.varying, sp.S.Zero)
    for what, expr in plain.all():
        if none_given and expr.xreplace(none_given).has(sp.nan, sp.oo, -sp.oo, sp.zoo):
            raise LinkwiseError(
                f"its {what} is no number where time and inputs are 0, as they are unless others are given; "
                "write it such that it is one there"
            )
    if symbolic:
        _check_exponents((power for _, expr in terms.all() for power in expr.atoms(sp.Pow)), set(values))
    chosen = terms if symbolic else plain
    if not symbols_of(chosen.all()) & {*motion.positions, *motion.velocities} and not any(
        chosen.forces.values()
    ):
        raise LinkwiseError("it depends on no coordinate; leave the link out")
    return sorted_terms(name, chosen, motion, numbers)


def _known(zero: sp.Expr, motion: WrittenMotion, values: dict[sp.Symbol, float], symbolic: bool) -> sp.Expr:
    """Return an expression with numbers for parameters unless they stay; raises LinkwiseError as terms do."""
    _check_known(zero.free_symbols, motion, values)
    plain = _whole(zero.xreplace({symbol: sp.Float(value, 17) for symbol, value in values.items()}))
    _check_real(zero, plain)
    return zero if symbolic else plain


def _check_known(
    symbols: Iterable[sp.Symbol], motion: WrittenMotion, values: Mapping[sp.Symbol, float]
) -> None:
    """Raise LinkwiseError for a symbol that is nothing of the system."""
    for symbol in sorted({*symbols} - {*motion.known(), *values}, key=str):
        if symbol.name in {parameter.name for parameter in (*values, *motion.varying)}:
            raise LinkwiseError(
                f"the symbol {symbol} is not the one among `parameters`, `time` and `inputs`: their "
                "assumptions differ; make it once and use it everywhere"
            )
        raise LinkwiseError(
            f"the symbol {symbol} is neither a coordinate (use its .q and .qd) nor among `parameters`; "
            "add it there"
        )


def _whole(energy: sp.Expr) -> sp.Expr:
    """Return the energy with exponents such as 2.0 or 1.5 as the fractions that they are.

    Other exponents are powers by the base's logarithm, which negative numbers do not have.
    """

    def with_a_point(part: sp.Basic) -> bool:
        return part.is_Pow and part.exp.is_Float and float(2 * part.exp).is_integer()

    return energy.replace(with_a_point, lambda power: power.base ** sp.Rational(power.exp))


def _check_exponents(powers: Iterable[sp.Pow], parameters: set[sp.Symbol]) -> None:
    """Raise LinkwiseError for a parameter as exponent of what may be negative: it need not be whole."""
    for power in sorted(powers, key=str):
        symbols = power.exp.free_symbols
        if symbols and symbols <= parameters and not power.base.is_nonnegative:
            raise LinkwiseError(
                f"{short(str(power))} has parameters in its exponent, which at run time is taken by the "
                f"logarithm of {short(str(power.base))}; generate with numbers for the parameters, write a "
                "number there, or make the base one that SymPy knows to be positive, as by "
                "sp.symbols(..., positive=True)"
            )


def _check_real(*energies: sp.Expr) -> None:
    for energy in energies:
        if energy.has(sp.nan, sp.oo, -sp.oo, sp.zoo):
            raise LinkwiseError("it holds NaN or infinity; look for a division by zero")
        if energy.has(sp.I):
            raise LinkwiseError("it holds the imaginary unit; energies and constraints are real")
        if any(abs(number) > float_info.max for number in energy.atoms(sp.Number)):
            raise LinkwiseError("it holds a number beyond 1e308; choose other units")
        if complex_numbers := [number for number in _numbers(energy) if sp.im(number.evalf()) != 0]:
            raise LinkwiseError(f"it holds {short(str(complex_numbers[0]))}, which is not a real number")


def _numbers(expr: sp.Basic) -> Iterator[sp.Expr]:
    """Yield the largest parts of an expression that are numbers."""
    if isinstance(expr, sp.Expr) and expr.is_number:
        yield expr
    else:
        for part in expr.args:
            yield from _numbers(part)
