"""Uncertainty of a robot before it is identified, and the file that says how uncertain it is afterwards."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from linkwise.analysis.covariance_table import MOST
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.uncertain_file import UncertainRobot, read_uncertain
from linkwise.arrays import Array
from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError, within
from linkwise.identification.identification_result import Identification

FILE = "uncertain.toml"
"""Name of the file for `analyze --uncertain`."""
OF_BODIES = ("schema", "all", "link", "body_mass", "correlation", "covariance")
"""Tables that tell of bodies."""
BOUND = 1.0
"""Distance of bodies from the fit, in standard errors, from which on the conditions on bodies count."""


def read_prior(path: Path, robot: OpenedRobot) -> UncertainRobot:
    """Return what a file says of the bodies of a robot that is to be identified.

    Raises LinkwiseError as `read_uncertain` does, and for what is not of bodies.
    """
    found = read_uncertain(path, robot)
    with within(str(path)):
        others = [key for key in toml_data(path, MOST) if key not in OF_BODIES]
        if found.bodies is not None and np.any(found.bodies.lengths):
            others.append("length")
        if others:
            raise LinkwiseError(f"{others[0]!r} counts as certain where links are identified; leave it out")
    return found


def uncertain_text(found: Identification, links: Sequence[str]) -> str:
    """Return the file that `analyze --uncertain` takes with the identified robot.

    links: their names there
    """
    factor = np.asarray(found.uncertain_bodies.parameters)
    lines = [
        "# Covariance of the links' parameters as identified, factor times its transpose: ten rows a link,",
        "# m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin of its joint's frame. It is of",
        "# the robot that stands beside this file.",
        "schema = 1",
        "",
        "[covariance]",
        f"note = {_text(note(found))}",
        f"links = [{', '.join(map(_text, links))}]",
        *_matrix("parameters", found.physical.pi),
        *_matrix("factor", factor.reshape(-1, factor.shape[-1])),
    ]
    return "\n".join([*lines, ""])


def note(found: Identification) -> str:
    """Return what the covariance is of, in a line."""
    counted = "counts as certain, so that shares which lean on it have too small deviations"
    if found.prior is not None:
        counted = f"is as uncertain as {found.prior.file} said of the bodies before"
    return (
        f"bodies are as torques of {Path(found.log.source).name} tell, within their noise; what these do not "
        f"tell, such as how masses are spread over links, {counted}"
    )


def doubt(found: Identification) -> str:
    """Return how far conditions on bodies and friction have moved the fit; "" where next to nothing."""
    if without(found) or (distance := found.unbound_distance) < BOUND:
        return ""
    return (
        f"bodies that can exist are {distance:.2g} standard errors from the fit, of which {FILE} tells the "
        "deviations"
    )


def without(found: Identification) -> str:
    """Return why there is no file for a robot; "" where there is one."""
    if found.robot.constrained is None:
        return ""
    return f"no {FILE}: joints of {found.robot.name} are tied, whose shares have no deviations yet"


def _matrix(key: str, rows: Array) -> list[str]:
    return [f"{key} = [", *(f"  [{', '.join(map(_number, row))}]," for row in rows.tolist()), "]"]


def _number(value: float) -> str:
    return "0.0" if value == 0.0 else repr(value)


def _text(text: str) -> str:
    """Return a string of TOML, whose escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False)
