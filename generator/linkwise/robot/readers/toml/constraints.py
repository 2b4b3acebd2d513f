"""Constraints in TOML ([[constraint]]): of a robot's own file, or of one beside a file of any format."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.robot import transforms
from linkwise.robot.description import Anchor, AnchoredTie, Description, JointCoupling
from linkwise.robot.readers.toml.formula import MAX_POWER
from linkwise.robot.readers.toml.table import TomlTable, as_float, named_parameters, tables
from linkwise.robot.robot import Rotation, TieKind, Vec3

TOP = ("schema", "parameters", "constraint", "independent")
COUPLING = ("name", "type", "terms")
TIE = ("name", "type", "first", "second")
ANCHOR = ("frame", "xyz", "rpy")
KINDS: tuple[TieKind, ...] = get_args(TieKind)


def with_constraint_file(description: Description, path: Path) -> Description:
    """Return a robot with the constraints of a file beside its own.

    Raises LinkwiseError for a file without constraints, or with a parameter that the robot's file has too.
    """
    require_file(path, wanted="a TOML file with [[constraint]] in it")
    data = toml_data(path)
    TomlTable("the file", data, TOP, {})
    parameters = named_parameters(data.get("parameters", {}))
    for name, _ in description.parameters:
        if name in parameters:
            raise LinkwiseError(f"parameter {name!r} is one of the robot's file already; rename it")
    described = replace(description, parameters=(*description.parameters, *parameters.items()))
    found = with_constraints(described, data)
    if not (found.ties or found.couplings or found.loops):
        raise LinkwiseError(
            "there is no [[constraint]] in it, nor any in the robot's file; add one, or leave the file out"
        )
    return found


def with_constraints(description: Description, data: dict[str, Any]) -> Description:
    """Return a robot with the constraints of a file's tables, in the parameters that it has."""
    parameters = dict(description.parameters)
    ties: list[AnchoredTie] = []
    couplings: list[JointCoupling] = []
    for item in tables(data, "constraint"):
        kind = item.get("type")
        place = f"constraint {item.get('name')!r}"
        if kind == "coupling":
            couplings.append(_coupling(TomlTable(place, item, COUPLING, parameters)))
        elif kind in KINDS:
            keys = (*TIE, "length") if kind == "distance" else TIE
            ties.append(_tie(TomlTable(place, item, keys, parameters), kind, description))
        else:
            known = listed((*KINDS, "coupling"), 20)
            raise LinkwiseError(f"{place} has the type {kind!r}; the types are {known}")
    return replace(
        description,
        ties=(*description.ties, *ties),
        couplings=(*description.couplings, *couplings),
        independent=_independent(data) or description.independent,
    )


def _independent(data: dict[str, Any]) -> tuple[str, ...]:
    names = data.get("independent", [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise LinkwiseError("'independent' must be a list of joints' names")
    return tuple(names)


def _tie(table: TomlTable, kind: TieKind, description: Description) -> AnchoredTie:
    if kind == "distance" and "length" not in table.data:
        raise LinkwiseError(f"{table.place} needs 'length', in m")
    first, second = (_anchor(table, end, kind, description) for end in ("first", "second"))
    length = table.scalar("length", table.data["length"]) if kind == "distance" else 0.0
    return AnchoredTie(table.text("name"), kind, first, second, length)


def _anchor(table: TomlTable, end: str, kind: TieKind, description: Description) -> Anchor:
    """Return a place on a link, or on a site of the file, which is given by its name or by a table."""
    data = table.data.get(end)
    if isinstance(data, str):
        data = {"frame": data}
    if not isinstance(data, dict):
        raise LinkwiseError(f"{table.place} needs {end!r}, a link's name or {{frame = NAME, xyz = […]}}")
    keys = (*ANCHOR, "axis") if kind == "hinge" else ANCHOR
    inner = TomlTable(f"{table.place}, {end}", data, keys, table.parameters)
    turn = transforms.snap(transforms.from_rpy(*inner.numbers("rpy", [0.0, 0.0, 0.0])))
    if "axis" in data:
        axis = transforms.unit(inner.numbers("axis", [0.0, 0.0, 1.0]))
        if axis is None:
            raise LinkwiseError(f"{inner.place} has a zero axis; give its direction, such as [0, 0, 1]")
        turn = transforms.compose(turn, transforms.align_z(axis))
    return _placed(inner.text("frame"), turn, inner.vector("xyz", [0.0, 0.0, 0.0]), description)


def _placed(frame: str, turn: Rotation, place: Vec3, description: Description) -> Anchor:
    """Return a place in the axes of a link or, if no link has the name, of a site, as a place on a link."""
    if frame in {body.name for body in description.bodies}:
        return Anchor(frame, turn, place)
    for site in description.sites:
        if site.name == frame:
            shift = transforms.rotate(site.rotation, place)
            return Anchor(
                site.body, transforms.compose(site.rotation, turn), transforms.add(site.translation, shift)
            )
    return Anchor(frame)


def _coupling(table: TomlTable) -> JointCoupling:
    terms = table.data.get("terms")
    if not isinstance(terms, dict) or not terms:
        raise LinkwiseError(
            f"{table.place} needs 'terms', {{JOINT = FACTOR, JOINT = [CONSTANT, FACTOR, …]}}, whose sum is 0"
        )
    return JointCoupling(
        table.text("name"), tuple((joint, _polynomial(table, joint, terms)) for joint in terms)
    )


def _polynomial(table: TomlTable, joint: str, terms: Mapping[str, Any]) -> tuple[float, ...]:
    value = terms[joint]
    numbers = value if isinstance(value, list) else [0.0, value]
    place = f"{table.place}: {joint!r} in 'terms'"
    if not all(isinstance(n, (int, float)) and not isinstance(n, bool) for n in numbers):
        raise LinkwiseError(f"{place} must be a factor, or a list of numbers")
    if len(numbers) > MAX_POWER + 1:
        raise LinkwiseError(f"{place} has the power {len(numbers) - 1}; {MAX_POWER} is the highest")
    found = tuple(as_float(place, n) for n in numbers)
    if not any(found[1:]):
        raise LinkwiseError(f"{place} is the same for every position; give a factor that is not 0")
    return found
