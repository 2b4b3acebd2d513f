"""Uncertainty of a robot's bodies as a file states it.

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

In [all] or [link.NAME], preset = "NAME" gives what the same table does not state: see `segment_presets`.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from linkwise_runtime.certainty.share_variances import share_variances
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies, checked_correlation

from linkwise.analysis.covariance_table import covariance_of
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.segment_presets import FittedSegment, fitted_segment
from linkwise.analysis.stated_sd import place_of, stated
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.package.decode import known_keys

TABLES = ("all", "link", "joint", "body_mass", "correlation", "covariance")
"""Tables of a file that are about bodies."""
PART, LENGTH = {"%": 0.01}, {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
MASS = {"%": 0.01, "kg": 1.0}
OF_LINKS = {"mass": MASS, "centre": LENGTH, "radii": PART}
"""Units of each key of a link, by what brings them to parts, kg or m."""
UNITS = OF_LINKS | {"length": LENGTH}
"""Units of each key, with that of joints."""
KEYS_OF_ALL = (*UNITS, "preset")
KEYS_OF_LINK = (*OF_LINKS, "preset", "segment")
LARGEST = 1.0
"""Largest deviation as a part: with more, one normal mass in six is negative."""


class StatedBodies(NamedTuple):
    """Bodies as a file says them."""

    bodies: UncertainBodies
    note: str
    """Note on their covariance, in a line; "" without."""
    fitted: Mapping[str, FittedSegment]
    """Segments of presets that links are, by their names."""


def read_bodies(data: Mapping[str, Any], robot: OpenedRobot) -> StatedBodies:
    """Return what a file's data says of bodies.

    Raises LinkwiseError, which names table and key, for what cannot be.
    """
    parameters, note = covariance_of(data, partial(_links, robot=robot), robot.package.manifest.tree)
    bodies, fitted = _bodies(data, robot)
    bodies = bodies._replace(parameters=parameters)
    if parameters is None and not any(np.any(one) for one in (*bodies[:4], bodies.lengths)):
        raise LinkwiseError("all deviations of bodies are 0; give some, or leave these tables out")
    if is_closed_form(robot):
        try:
            share_variances(robot.model.backend, bodies)
        except ValueError as error:
            raise LinkwiseError(str(error)) from None
    else:
        check_lengths(bodies, "leave length out, or --contact and --payload")
    return StatedBodies(bodies, note, fitted)


def check_lengths(bodies: UncertainBodies, mend: str) -> None:
    """Raise LinkwiseError for uncertain lengths where more than torques of an open tree are told."""
    if np.any(bodies.lengths):
        raise LinkwiseError(f"lengths count in torques of an open tree that bears no payload alone; {mend}")


def is_closed_form(robot: OpenedRobot) -> bool:
    """Return whether what bodies do to a robot's torques is known from regressors: of an open tree alone."""
    return robot.constrained is None and robot.contacts is None and not robot.payloads


def refuse_unmodelled(robot: OpenedRobot) -> None:
    """Raise LinkwiseError for a robot whose bodies cannot be uncertain here."""
    reasons = {
        f"the links of {robot.name} are energies, which do not say what bodies they have": robot.tree is None,
        "autograd has no regressors; take --backend numpy, torch or native": robot.backend == "autograd",
    }
    for reason, holds in reasons.items():
        if holds:
            raise LinkwiseError(f"--uncertain: {reason}")


def _bodies(data: Mapping[str, Any], robot: OpenedRobot) -> tuple[UncertainBodies, dict[str, FittedSegment]]:
    usual = known_keys("[all]", data.get("all", {}), KEYS_OF_ALL)
    own = _named(data, "link", robot.links[: link_count(robot)], KEYS_OF_LINK, robot)
    found: dict[str, list[Any]] = {key: [] for key in OF_LINKS}
    every: dict[str, FittedSegment] = {}
    assert robot.package.manifest.tree is not None  # as `refuse_unmodelled` has seen
    bodies = robot.package.manifest.tree.links
    for name, body in zip(robot.links[: link_count(robot)], bodies, strict=True):
        table = own.get(name, {})
        fitted = fitted_segment(name, table, usual, body.mass)
        if fitted is not None:
            every[name] = fitted
        for key in OF_LINKS:
            if fitted is not None and key not in (table if "preset" in table else {**usual, **table}):
                found[key].append(fitted.deviations[key])
                continue
            place = f"[link.{name}]" if key in table else "[all]"
            given = table.get(key, usual.get(key))
            found[key].append(_deviation(place, key, given, body.mass, name))
    part, segments = _body_mass(data, robot)
    stated = UncertainBodies(
        np.array(found["mass"]),
        np.array(found["centre"]),
        np.array(found["radii"]),
        part,
        segments,
        _correlation(data, robot, found["mass"]),
        _lengths(data, usual, robot),
    )
    return stated, every


def _named(
    data: Mapping[str, Any], what: str, names: Sequence[str], keys: Iterable[str], robot: OpenedRobot
) -> dict[str, dict[str, Any]]:
    """Return the tables of links or joints by name."""
    tables = data.get(what, {})
    if not isinstance(tables, dict):
        raise LinkwiseError(f"{what} must hold tables by name; head each [{what}.NAME]")
    for name, table in tables.items():
        place_of(f"[{what}.{name}]", what, name, names, robot)
        known_keys(f"[{what}.{name}]", table, keys)
    return tables


def _lengths(data: Mapping[str, Any], usual: Mapping[str, Any], robot: OpenedRobot) -> Array:
    """Return deviations of the places of the tree's joints in m, (F, 3).

    That of all is for joints that are off the origin of what carries them: several axes in one place would
    else each have an error of its own.
    """
    tree = robot.package.manifest.tree
    assert tree is not None  # as `refuse_unmodelled` has seen
    own, found = _named(data, "joint", robot.tree_joints, ("length",), robot), []
    for name, joint in zip(robot.tree_joints, tree.joints, strict=True):
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
        return [0.0 if one is None else stated(place, key, one, UNITS[key])[0] for one in several]
    if given is None:
        return 0.0
    value, unit = stated(place, key, given, UNITS[key])
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
        return 0.0, np.zeros(link_count(robot))
    place = "[body_mass]"
    table = known_keys(place, data["body_mass"], ("sd", "links"))
    if "sd" not in table:
        raise LinkwiseError(f'{place} needs sd, such as "2 %"')
    value, _ = stated(place, "sd", table["sd"], PART)
    if value > LARGEST:
        raise LinkwiseError(f"{place}: sd is {table['sd']}; give 100 % at most")
    segments = np.zeros(link_count(robot))
    segments[_links(place, table["links"], robot) if "links" in table else slice(None)] = 1.0
    return value, segments


def _correlation(data: Mapping[str, Any], robot: OpenedRobot, masses: Sequence[float]) -> Array | None:
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
    certain = [robot.links[j] for j in numbers if not masses[j]]
    if certain:
        raise LinkwiseError(f"{place}: the mass of {certain[0]!r} is certain; give it a deviation of its own")
    whole = np.eye(link_count(robot))
    whole[np.ix_(numbers, numbers)] = own
    return whole


def _links(place: str, given: Any, robot: OpenedRobot) -> list[int]:
    """Return the numbers of links that are listed by name."""
    if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
        raise LinkwiseError(f"{place} needs links, a list of their names")
    found = [place_of(place, "link", name, robot.links[: link_count(robot)], robot) for name in given]
    if len(set(found)) < len(found):
        raise LinkwiseError(f"{place}: links names one twice; name each once")
    return found


def link_count(robot: OpenedRobot) -> int:
    """Return the number of links of the robot's file: payloads, which come last, are certain."""
    return len(robot.links) - len(robot.payloads)
