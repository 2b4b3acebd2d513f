"""File that says how uncertain a robot's bodies are: deviations of masses, centres, radii and lengths.

schema = 1
[all]                        # every link, unless its own table says otherwise
mass = "10 %"
centre = "10 mm"             # along each axis; or three, along the body's own x, y and z
radii = "10 %"               # each of the three radii of gyration about the centre
length = "3 mm"              # place of each joint that is off its body's origin, along each axis
[link.forearm]
mass = "0.1 kg"
centre = ["5 mm", "5 mm", "20 mm"]
[joint.elbow]
length = ["0 mm", "4 mm", "0 mm"]
[body_mass]                  # a mass of which links have fixed parts: their masses go together by it
sd = "2 %"
links = ["upper_arm", "forearm"]
[correlation]                # of these links' own errors of mass
links = ["upper_arm", "forearm"]
matrix = [[1.0, 0.5], [0.5, 1.0]]
[covariance]                 # of all inertial parameters of links: see `covariance_table`
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from linkwise_runtime.certainty.share_deviations import share_deviations
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies, checked_correlation
from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.covariance_table import MOST, covariance_of
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.package.decode import known_keys

TOP = ("schema", "all", "link", "joint", "body_mass", "correlation", "covariance")
PART, LENGTH = {"%": 0.01}, {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
MASS = {"%": 0.01, "kg": 1.0}
OF_LINKS = {"mass": MASS, "centre": LENGTH, "radii": PART}
"""Units of each key of a link, by what brings them to parts, kg or m."""
UNITS = OF_LINKS | {"length": LENGTH}
"""Units of each key, with that of joints."""
NOT_MODELLED = {
    "axis": "axes of joints count as certain",
    "motion": "motion counts as certain",
    "loads": "loads count as certain",
    "preset": "there are no presets; write the numbers of your source",
}
"""Keys that others might expect, and what is so."""
CERTAIN = "motion, loads, axes of joints, springs, damping, friction, armature"
"""All that counts as certain."""
LARGEST = 1.0
"""Largest deviation as a part: with more, one normal mass in six is negative."""
QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([%a-z]+)\s*")


@dataclass(frozen=True, eq=False)
class UncertainRobot:
    """Uncertainty of the bodies of a robot, as a file says it."""

    file: str
    """Name of the file."""
    bodies: UncertainBodies
    links: tuple[str, ...]
    joints: tuple[str, ...]
    """Joints of the tree."""
    note: str = ""
    """Note of the file on its covariance of parameters, in a line; "" without."""

    def record(self) -> dict[str, Any]:
        """Return what was assumed as plain data: parts of masses and of radii, centres in m."""
        given = self.bodies
        masses, centres, radii = (np.asarray(a).tolist() for a in given[:3])
        told = zip(self.links, masses, centres, radii, strict=True)
        return {
            "file": self.file,
            "links": [
                {"name": name, "mass": mass, "centre": centre, "radii": longer}
                for name, mass, centre, longer in told
            ],
            "body_mass": given.body_mass,
            "segments": [
                name
                for name, part in zip(self.links, np.asarray(given.segments).tolist(), strict=True)
                if part
            ],
            "joints": [
                {"name": name, "length": length}
                for name, length in zip(self.joints, np.asarray(given.lengths).tolist(), strict=True)
            ],
            "correlation": None if given.correlation is None else np.asarray(given.correlation).tolist(),
            "covariance_of_parameters": given.parameters is not None,
            "note": self.note,
            "certain": CERTAIN,
        }


def read_uncertain(path: Path, robot: OpenedRobot) -> UncertainRobot:
    """Return what a file says of a robot's bodies.

    Raises LinkwiseError, which names file, table and key, for what cannot be read, for deviations and
    correlations that cannot be, for a link that is not there, and for a robot whose deviations are not
    modelled: energies written by hand, tied joints, contacts, payloads, the back end autograd.
    """
    refuse_unmodelled(robot)
    with within(str(path)):
        require_file(path)
        data = toml_data(path, MOST)
        for key in (*data, *(key for table in _tables(data) for key in table)):
            if key in NOT_MODELLED:
                raise LinkwiseError(f"{key!r} is not modelled: {NOT_MODELLED[key]}; leave it out")
        known_keys("the file", data, TOP)
        parameters, note = covariance_of(data, partial(_links, robot=robot), robot.tree)
        bodies = _bodies(data, robot)._replace(parameters=parameters)
        try:
            share_deviations(robot.model.backend, bodies)
        except ValueError as error:
            raise LinkwiseError(str(error)) from None
    return UncertainRobot(path.name, bodies, robot.links, robot.tree_joints, note)


def refuse_unmodelled(robot: OpenedRobot) -> None:
    """Raise LinkwiseError for a robot whose shares have no deviations here."""
    reasons = {
        f"the links of {robot.name} are energies, which do not say what bodies they have": robot.tree is None,
        f"joints of {robot.name} are tied, whose shares have no deviations yet": robot.constrained
        is not None,
        "what contacts leave to the joints has no deviations yet; leave --contact out": robot.contacts
        is not None,
        "payloads have no deviations yet; leave --payload out, or describe the load as a link": bool(
            robot.payloads
        ),
        "autograd has no regressors; take --backend numpy, torch or native": robot.backend == "autograd",
    }
    for reason, holds in reasons.items():
        if holds:
            raise LinkwiseError(f"--uncertain: {reason}")


def _tables(data: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the tables of links and joints, with that of all."""
    several = [data.get(key) for key in ("link", "joint")]
    every = [
        data.get("all"),
        *(own for group in several if isinstance(group, dict) for own in group.values()),
    ]
    return [table for table in every if isinstance(table, dict)]


def _bodies(data: Mapping[str, Any], robot: OpenedRobot) -> UncertainBodies:
    usual = known_keys("[all]", data.get("all", {}), UNITS)
    own = _named(data, "link", robot.links, OF_LINKS, robot)
    found: dict[str, list[Any]] = {key: [] for key in OF_LINKS}
    assert robot.tree is not None
    for name, body in zip(robot.links, robot.tree.links, strict=True):
        table = own.get(name, {})
        for key in OF_LINKS:
            place = f"[link.{name}]" if key in table else "[all]"
            given = table.get(key, usual.get(key))
            found[key].append(_deviation(place, key, given, body.mass, name))
    part, segments = _body_mass(data, robot)
    return UncertainBodies(
        np.array(found["mass"]),
        np.array(found["centre"]),
        np.array(found["radii"]),
        part,
        segments,
        _correlation(data, robot),
        _lengths(data, usual, robot),
    )


def _named(
    data: Mapping[str, Any], what: str, names: Sequence[str], keys: Iterable[str], robot: OpenedRobot
) -> dict[str, dict[str, Any]]:
    """Return the tables of links or joints by name."""
    tables = data.get(what, {})
    if not isinstance(tables, dict):
        raise LinkwiseError(f"{what} must hold tables by name; head each [{what}.NAME]")
    for name, table in tables.items():
        _place(f"[{what}.{name}]", what, name, names, robot)
        known_keys(f"[{what}.{name}]", table, keys)
    return tables


def _lengths(data: Mapping[str, Any], usual: Mapping[str, Any], robot: OpenedRobot) -> Array:
    """Return deviations of the places of the tree's joints in m, (F, 3).

    That of all is for joints that are off the origin of what carries them: several axes in one place would
    else each have an error of its own.
    """
    assert robot.tree is not None
    own, found = _named(data, "joint", robot.tree_joints, ("length",), robot), []
    for name, joint in zip(robot.tree_joints, robot.tree.joints, strict=True):
        table = own.get(name, {})
        given = table.get("length", usual.get("length") if any(joint.translation) else None)
        place = f"[joint.{name}]" if "length" in table else "[all]"
        found.append(_deviation(place, "length", given, 0.0, name))
    return np.array(found)


def _deviation(place: str, key: str, given: Any, mass: float, link: str) -> Any:
    """Return the deviation of one key: a part, or for a place three lengths in m."""
    if UNITS[key] is LENGTH:
        several = given if isinstance(given, list) else [given] * 3
        if len(several) != 3:
            raise LinkwiseError(
                f'{place}: {key} has {len(several)} numbers; give "10 mm", or three for x, y, z'
            )
        return [0.0 if one is None else _quantity(place, key, one)[0] for one in several]
    if given is None:
        return 0.0
    value, unit = _quantity(place, key, given)
    if unit == "kg":
        if not mass > 0:
            raise LinkwiseError(f"{place}: {link!r} has no mass in the robot's file; give a part of it, in %")
        value /= mass
    if value > LARGEST:
        raise LinkwiseError(
            f"{place}: {key} of {link!r} is {given}, {100 * value:.3g} % of what it is of; give 100 % at most"
        )
    return value


def _body_mass(data: Mapping[str, Any], robot: OpenedRobot) -> tuple[float, Array]:
    """Return the deviation of the body mass, and ones for its links."""
    if "body_mass" not in data:
        return 0.0, np.zeros(len(robot.links))
    place = "[body_mass]"
    table = known_keys(place, data["body_mass"], ("sd", "links"))
    if "sd" not in table:
        raise LinkwiseError(f'{place} needs sd, such as "2 %"')
    value, _ = _quantity(place, "sd", table["sd"], PART)
    if value > LARGEST:
        raise LinkwiseError(f"{place}: sd is {table['sd']}; give 100 % at most")
    segments = np.zeros(len(robot.links))
    segments[_links(place, table["links"], robot) if "links" in table else slice(None)] = 1.0
    return value, segments


def _correlation(data: Mapping[str, Any], robot: OpenedRobot) -> Array | None:
    """Return the correlations of all links' masses; None where the file has none."""
    if "correlation" not in data:
        return None
    place = "[correlation]"
    table = known_keys(place, data["correlation"], ("links", "matrix"))
    numbers = _links(place, table.get("links"), robot)
    rows = table.get("matrix")
    shaped = isinstance(rows, list) and len(rows) == len(numbers)
    if not shaped or any(not isinstance(row, list) or len(row) != len(numbers) for row in rows or ()):
        raise LinkwiseError(f"{place} needs matrix, {len(numbers)} rows of {len(numbers)} numbers")
    if any(isinstance(x, bool) or not isinstance(x, (int, float)) for row in rows or () for x in row):
        raise LinkwiseError(f"{place}: matrix holds what is no number")
    try:
        own = checked_correlation([robot.links[j] for j in numbers], rows)
    except ValueError as error:
        raise LinkwiseError(f"{place}: {error}") from None
    whole = np.eye(len(robot.links))
    whole[np.ix_(numbers, numbers)] = own
    return whole


def _links(place: str, given: Any, robot: OpenedRobot) -> list[int]:
    """Return the numbers of links that are listed by name."""
    if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
        raise LinkwiseError(f"{place} needs links, a list of their names")
    found = [_place(place, "link", name, robot.links, robot) for name in given]
    if len(set(found)) < len(found):
        raise LinkwiseError(f"{place}: links names one twice; name each once")
    return found


def _place(place: str, what: str, name: str, names: Sequence[str], robot: OpenedRobot) -> int:
    """Return the number of a link or a joint."""
    if name not in names:
        near = listed(nearest_first(name, names))
        raise LinkwiseError(f"{place}: {robot.name} has no {what} {name!r}; its {what}s are {near}")
    return names.index(name)


def _quantity(
    place: str, key: str, given: Any, units: Mapping[str, float] | None = None
) -> tuple[float, str]:
    """Return a deviation in SI units, parts for %, and the unit as it is written."""
    known: Sequence[str] = tuple(units or UNITS[key])
    found = QUANTITY.fullmatch(given) if isinstance(given, str) else None
    if found is None or found[2] not in known:
        example = {"mm": '"10 mm"', "%": '"10 %"'}[known[0]]
        raise LinkwiseError(
            f"{place}: {key} is {given!r}; write a number and its unit, {' or '.join(known)}, as in {example}"
        )
    value = float(found[1])
    if value < 0 or not math.isfinite(value):
        raise LinkwiseError(f"{place}: {key} is {given}; a standard deviation is 0 or more, and finite")
    return value * (units or UNITS[key])[found[2]], found[2]
