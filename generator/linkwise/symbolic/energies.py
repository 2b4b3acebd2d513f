"""Systems whose link energies a user writes in SymPy."""

import runpy
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import sympy as sp

from linkwise.errors import LinkwiseError, within
from linkwise.model.robot import Coordinate, is_finite
from linkwise.symbolic.system import LinkEnergy, System


def energy_system(
    name: str,
    coordinates: Iterable[Coordinate],
    links: Iterable[LinkEnergy],
    parameters: Mapping[sp.Symbol, float] | None = None,
    symbolic: bool = False,
) -> System:
    """System from link energies, checked: every symbol known, degree at most 2 in the velocities.

    `parameters` gives each other symbol its value; they become numbers unless `symbolic`. Velocity terms of
    the potential count as kinetic, terms of the kinetic energy without velocities as potential.

    Raises LinkwiseError naming the link.
    """
    coordinates, links, values = tuple(coordinates), tuple(links), dict(parameters or {})
    _check_names(coordinates, links, values)
    checked = []
    for link in links:
        with within(f"link {link.name!r}"):
            checked.append(_checked(link, coordinates, values, symbolic))
    return System(name, coordinates, tuple(checked), values if symbolic else {})


def read_energies(path: Path, symbolic: bool = False) -> System:
    """Run a Python file that defines `coordinates`, `links` and perhaps `parameters`, as `energy_system`."""
    try:
        scope: dict[str, Any] = runpy.run_path(str(path))
    except LinkwiseError:
        raise
    except Exception as error:  # the user's own code may raise anything
        raise LinkwiseError(f"running the file failed: {type(error).__name__}: {error}") from error
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


def _check_names(
    coordinates: tuple[Coordinate, ...],
    links: tuple[LinkEnergy, ...],
    values: dict[sp.Symbol, float],
) -> None:
    if not coordinates or not links:
        raise LinkwiseError("there must be at least one coordinate and one link")
    for what, names in (
        ("coordinate", [c.name for c in coordinates]),
        ("link", [k.name for k in links]),
    ):
        for name in names:
            if not name.strip() or names.count(name) > 1:
                fault = "is used twice" if name.strip() else "is empty"
                raise LinkwiseError(f"the {what} name {name!r} {fault}; give each its own")
    for symbol, value in values.items():
        if symbol in {s for c in coordinates for s in (c.q, c.qd)}:
            raise LinkwiseError(f"{symbol} is both a coordinate and a parameter; rename one")
        if not is_finite(float(value)):
            raise LinkwiseError(f"parameter {symbol} is NaN or infinite; give a number")


def _checked(
    link: LinkEnergy,
    coordinates: tuple[Coordinate, ...],
    values: dict[sp.Symbol, float],
    symbolic: bool,
) -> LinkEnergy:
    kinetic, potential = sp.sympify(link.kinetic), sp.sympify(link.potential)
    velocities = [c.qd for c in coordinates]
    known = {c.q for c in coordinates} | set(velocities) | set(values)
    for symbol in sorted((kinetic - potential).free_symbols - known, key=str):
        raise LinkwiseError(
            f"the symbol {symbol} is neither a coordinate (use its .q and .qd) nor among `parameters`; "
            "add it there"
        )
    if not symbolic:
        numbers = {symbol: sp.Float(float(value), 17) for symbol, value in values.items()}
        kinetic, potential = kinetic.xreplace(numbers), potential.xreplace(numbers)
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


def _check_degree(lagrangian: sp.Expr, velocities: list[sp.Symbol]) -> None:
    try:
        degree = sp.Poly(lagrangian, *velocities, domain="EX").total_degree()
    except sp.PolynomialError:
        raise LinkwiseError(
            "its energies are no polynomial in the velocities; use terms up to degree 2"
        ) from None
    if degree > 2:
        raise LinkwiseError(
            f"its energies have degree {degree} in the velocities; this method takes terms up to degree 2"
        )
