"""Systems whose link energies a user writes in SymPy."""

import runpy
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from sys import float_info
from traceback import walk_tb
from typing import Any

import sympy as sp

from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.robot.coordinates import check_joints
from linkwise.robot.robot import Coordinate, unusable
from linkwise.symbolic.passed_over import refuse_passed_over
from linkwise.symbolic.system import EnergySystem, LinkEnergy

MOST_EXPANDED = 50
"""Largest power of velocities that is multiplied out: a larger one may never finish."""


def energy_system(
    name: str,
    coordinates: Iterable[Coordinate],
    links: Iterable[LinkEnergy],
    parameters: Mapping[sp.Symbol, float] | None = None,
    symbolic: bool = False,
) -> EnergySystem:
    """Return the system of link energies, checked: every symbol known, degree at most 2 in the velocities.

    `parameters` gives each other symbol its value; they become numbers unless `symbolic`, and
    those that no energy has are left out. Velocity terms of the potential count as kinetic, terms of the
    kinetic energy without velocities as potential.

    Raises LinkwiseError naming the link, and for more coordinates than can be generated.
    """
    coordinates, links = tuple(coordinates), tuple(links)
    check_joints(len(coordinates), "leave some out")
    _check_names(name, coordinates, links)
    values = _values(parameters or {}, coordinates)
    checked = []
    for link in links:
        with within(f"link {link.name!r}"):
            checked.append(_checked(link, coordinates, values, symbolic))
    used = set().union(*(link.kinetic.free_symbols | link.potential.free_symbols for link in checked))
    kept = {symbol: value for symbol, value in values.items() if symbol in used}
    request = {"parameters": "symbolic" if symbolic else "numeric"}
    return EnergySystem(name, coordinates, tuple(checked), kept if symbolic else {}, request=request)


def read_energies(path: Path, symbolic: bool = False) -> EnergySystem:
    """Return the system of a Python file that defines `coordinates`, `links`, and optionally other names.

    The file is run; the other names are `parameters` and `name`. Raises LinkwiseError as `energy_system`
    does, and for a name that nobody reads.
    """
    try:
        scope: dict[str, Any] = runpy.run_path(str(path))
    except LinkwiseError:
        raise
    except (Exception, SystemExit) as error:  # the user's own code may raise anything
        raise LinkwiseError(f"running the file failed{_said(error, str(path))}") from error
    refuse_passed_over(path.read_bytes(), scope)
    for required, kind in (("coordinates", Coordinate), ("links", LinkEnergy)):
        items = scope.get(required)
        if not isinstance(items, (list, tuple)) or not all(isinstance(item, kind) for item in items):
            raise LinkwiseError(f"the file must define {required!r}, a list of linkwise.{kind.__name__}")
    return energy_system(
        scope.get("name", path.stem),
        scope["coordinates"],
        scope["links"],
        scope.get("parameters"),
        symbolic,
    )


def _said(error: BaseException, path: str) -> str:
    """Return in words the last line of the user's file that an error passed through, and the error."""
    said = _text_of(error)
    lines = [at for frame, at in walk_tb(error.__traceback__) if frame.f_code.co_filename == path]
    if isinstance(error, SyntaxError) and error.filename == path:
        lines, said = [error.lineno] if error.lineno else [], error.msg
    place = f" in line {lines[-1]}" if lines else ""
    return f"{place}: {type(error).__name__}{': ' if said else ''}{said}"


def _text_of(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # the user's own class may raise here, too
        return ""


def _check_names(name: str, coordinates: tuple[Coordinate, ...], links: tuple[LinkEnergy, ...]) -> None:
    if not isinstance(name, str):
        raise LinkwiseError(f"the robot's name is {name!r}; give a string")
    if not coordinates or not links:
        raise LinkwiseError("there must be at least one coordinate and one link")
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


def _values(
    parameters: Mapping[sp.Symbol, float], coordinates: tuple[Coordinate, ...]
) -> dict[sp.Symbol, float]:
    """Return the parameters with float values; one symbol a name, as generated code knows names only."""
    if not isinstance(parameters, Mapping) or not all(isinstance(s, sp.Symbol) for s in parameters):
        raise LinkwiseError("`parameters` must be a dictionary of SymPy symbols and their values")
    for name, count in Counter(symbol.name for symbol in parameters).items():
        if count > 1:
            raise LinkwiseError(
                f"{count} different parameters are called {name}, told apart by their assumptions only; "
                "rename all but one"
            )
    values = {}
    for symbol, value in parameters.items():
        if symbol in {s for c in coordinates for s in (c.q, c.qd)}:
            raise LinkwiseError(f"{symbol} is both a coordinate and a parameter; rename one")
        if isinstance(value, (str, bytes, bool)):
            raise LinkwiseError(f"parameter {symbol} is {short(repr(value))}; give a number, without quotes")
        try:
            values[symbol] = float(value)
        except (TypeError, ValueError, OverflowError):
            raise LinkwiseError(f"parameter {symbol} has no value as a real number; give one") from None
        if fault := unusable(values[symbol]):
            raise LinkwiseError(f"parameter {symbol} has {fault} for a value; give a number")
    return values


def _checked(
    link: LinkEnergy,
    coordinates: tuple[Coordinate, ...],
    values: dict[sp.Symbol, float],
    symbolic: bool,
) -> LinkEnergy:
    kinetic = _whole(_expression("kinetic", link.kinetic))
    potential = _whole(_expression("potential", link.potential))
    velocities = [c.qd for c in coordinates]
    known = {c.q for c in coordinates} | set(velocities) | set(values)
    for symbol in sorted((kinetic.free_symbols | potential.free_symbols) - known, key=str):
        if symbol.name in {parameter.name for parameter in values}:
            raise LinkwiseError(
                f"the symbol {symbol} is not the one among `parameters`: their assumptions differ; "
                "make it once and use it everywhere"
            )
        raise LinkwiseError(
            f"the symbol {symbol} is neither a coordinate (use its .q and .qd) nor among `parameters`; "
            "add it there"
        )
    numbers = {symbol: sp.Float(value, 17) for symbol, value in values.items()}
    plain = _whole(kinetic.xreplace(numbers)), _whole(potential.xreplace(numbers))
    _check_real(kinetic, potential, *plain)
    if symbolic:
        _check_exponents(kinetic.atoms(sp.Pow) | potential.atoms(sp.Pow), set(values))
    else:
        kinetic, potential = plain
    _check_degree(kinetic - potential, velocities)
    if not (kinetic - potential).free_symbols & (known - set(values)):
        raise LinkwiseError("its energies depend on no coordinate; leave the link out")
    rest = dict.fromkeys(velocities, sp.S.Zero)
    moving = potential.free_symbols & set(velocities) or kinetic.subs(rest) != 0
    if moving:
        lagrangian = kinetic - potential
        potential = -lagrangian.subs(rest)
        kinetic = lagrangian + potential
    return LinkEnergy(link.name, kinetic, potential)


def _expression(what: str, energy: object) -> sp.Expr:
    try:
        expression = sp.sympify(energy, strict=True)
    except sp.SympifyError:
        expression = None
    if not isinstance(expression, sp.Expr):
        raise LinkwiseError(f"its {what} energy is {energy!r}; give a SymPy expression, 0 for none")
    return expression


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
            raise LinkwiseError("its energies hold NaN or infinity; look for a division by zero")
        if energy.has(sp.I):
            raise LinkwiseError("its energies hold the imaginary unit; energies are real")
        if any(abs(number) > float_info.max for number in energy.atoms(sp.Number)):
            raise LinkwiseError("its energies hold a number beyond 1e308; choose other units")
        if complex_numbers := [number for number in _numbers(energy) if sp.im(number.evalf()) != 0]:
            raise LinkwiseError(
                f"its energies hold {short(str(complex_numbers[0]))}, which is not a real number"
            )


def _numbers(expr: sp.Basic) -> Iterator[sp.Expr]:
    """Yield the largest parts of an expression that are numbers."""
    if isinstance(expr, sp.Expr) and expr.is_number:
        yield expr
    else:
        for part in expr.args:
            yield from _numbers(part)


def _check_degree(lagrangian: sp.Expr, velocities: list[sp.Symbol]) -> None:
    powers = [power.exp for power in lagrangian.atoms(sp.Pow) if power.base.free_symbols & set(velocities)]
    degree = max((exponent for exponent in powers if exponent.is_Integer), default=0)
    try:
        if degree <= MOST_EXPANDED:
            degree = sp.Poly(lagrangian, *velocities, domain="EX").total_degree()
    except sp.PolynomialError:
        raise LinkwiseError(
            "its energies are not polynomials in the velocities; use terms up to degree 2"
        ) from None
    if degree > 2:
        raise LinkwiseError(
            f"its energies have degree {degree} in the velocities; this method takes terms up to degree 2"
        )
