"""File that says how uncertain a robot's bodies, a log's motion and loads are.

schema = 1                   # tables of bodies: see `stated_bodies`
[motion]                     # see `uncertain_motion`
[loads]                      # see `uncertain_loads`
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from linkwise.analysis.covariance_table import MOST
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.segment_presets import FittedSegment, presets_record
from linkwise.analysis.stated_bodies import TABLES, link_count, read_bodies, refuse_unmodelled
from linkwise.analysis.uncertain_loads import StatedLoads, read_loads
from linkwise.analysis.uncertain_motion import StatedNoise, read_motion
from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import require_file
from linkwise.package.decode import known_keys

TOP = ("schema", *TABLES, "motion", "loads", "load")
NOT_MODELLED = {"axis": "axes of joints count as certain"}
"""Keys that others might expect, and what is so."""
CERTAIN = "axes of joints, springs, damping, friction, armature"
"""All that counts as certain on every path."""


@dataclass(frozen=True, eq=False)
class UncertainRobot:
    """Uncertainty of a robot's bodies, its motion and its loads, as a file says it."""

    file: str
    """Name of the file."""
    bodies: UncertainBodies | None
    motion: StatedNoise | None
    loads: StatedLoads | None
    links: tuple[str, ...]
    joints: tuple[str, ...]
    """Joints of the tree."""
    note: str = ""
    """Note of the file on its covariance of parameters, in a line; "" without."""
    fitted: Mapping[str, FittedSegment] = field(default_factory=dict)
    """Segments of presets that links are, by their names."""

    def record(self) -> dict[str, Any]:
        """Return what was assumed of bodies as plain data: parts of masses and of radii, centres in m."""
        given = self.bodies
        if given is None:
            return {}
        masses, centres, radii = (np.asarray(a).tolist() for a in given[:3])
        told = zip(self.links, masses, centres, radii, strict=True)
        return {
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
            "presets": presets_record(self.fitted),
            "note": self.note,
        }


def read_uncertain(path: Path, robot: OpenedRobot) -> UncertainRobot:
    """Return what a file says of a robot's bodies, motion and loads.

    Raises LinkwiseError, which names file, table and key, for what cannot be read, for deviations and
    correlations that cannot be, for a link that is not there, and for a robot the deviations of whose bodies
    are not modelled: energies written by hand, the back end autograd.
    """
    with within(str(path)):
        require_file(path)
        data = toml_data(path, MOST)
        for key in (*data, *(key for table in _tables(data) for key in table)):
            if key in NOT_MODELLED:
                raise LinkwiseError(f"{key!r} is not modelled: {NOT_MODELLED[key]}; leave it out")
        known_keys("the file", data, TOP)
        given = set(data) - {"schema"}
        if not given:
            raise LinkwiseError("nothing is uncertain; give [all], [link.NAME], [motion] or [loads]")
        motion = read_motion(data["motion"], robot) if "motion" in given else None
        loads = read_loads(data.get("loads"), data.get("load", {})) if given & {"loads", "load"} else None
    told = None
    if given & set(TABLES):
        refuse_unmodelled(robot)
        with within(str(path)):
            told = read_bodies(data, robot)
    named = (robot.links[: link_count(robot)], robot.tree_joints)
    if told is None:
        return UncertainRobot(path.name, None, motion, loads, *named)
    return UncertainRobot(path.name, told.bodies, motion, loads, *named, told.note, told.fitted)


def _tables(data: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the tables of links and joints, with that of all."""
    several = [data.get(key) for key in ("link", "joint")]
    every = [
        data.get("all"),
        *(own for group in several if isinstance(group, dict) for own in group.values()),
    ]
    return [table for table in every if isinstance(table, dict)]
