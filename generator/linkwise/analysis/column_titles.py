"""Titles of columns for people: "right knee torque" in the place of tau/knee_angle_r."""

import re
from collections.abc import Mapping
from typing import NamedTuple
from urllib.parse import unquote

from linkwise.analysis.motion_words import MotionWords, shown_joints
from linkwise.analysis.net_causes import NET, label_of

TITLES = {
    "q": "{0}",
    "qd": "{0} velocity",
    "qdd": "{0} acceleration",
    "tau": "{0} torque",
    "tau_before_muscles": "{0} torque before muscles",
    "tau/": "{0} torque through {1}",
    "tau_qdd/": "{0} torque through {1} by the acceleration of {2}",
    "tau_qd/": "{0} torque through {1} by the velocity of {2}",
    "tau_gravity/": "{0} torque through {1} by gravity",
    "tau_share/": "{0} torque through {1} by {2}",
    "tau_by/": "{0} torque by {1}",
    "tau_spring": "{0} torque for its spring",
    "tau_damping": "{0} torque for its damping",
    "tau_friction": "{0} torque for its friction",
    "tau_armature": "{0} torque for its armature",
    "tau_load/": "{0} torque by {1}",
    "power": "{0} power",
    "power/": "{0} power into {1}",
    "power_load/": "{0} power against {1}",
}
"""Title by what a column's name begins with, where names of joints stand in order; a slash says that more
follows the first of them."""
FORCE = re.compile(r"k?N(·s)?(/kg)?|% BW(·s)?")
"""Unit of a force or its impulse, which a coordinate has that slides."""
INTEGRALS = {
    "integral": "integral of {}",
    "integral_positive": "positive part of {}, integrated",
    "integral_negative": "negative part of {}, integrated",
}


class ColumnTitle(NamedTuple):
    """Title of a column, and which of its directions is positive; empty where that is not known."""

    title: str
    signs: str = ""

    def unit(self, unit: str) -> str:
        """Return a label of an axis: the unit, and what is above zero and below it."""
        return f"{unit}\n{self.signs}" if self.signs else unit


def column_title(name: str, words: Mapping[str, MotionWords], unit: str) -> ColumnTitle:
    """Return the title of a column; its name where there is none in words.

    words: words of coordinates, by name; unit: the column's, which tells a force from a torque
    """
    kind, *parts = name.split("/")
    if kind in INTEGRALS and parts:
        inner = column_title("/".join(parts), words, unit)
        return ColumnTitle(INTEGRALS[kind].format(inner.title))
    template = TITLES.get(f"{kind}/" if len(parts) > 1 else kind)
    if template is None or template.count("{") != len(parts):
        return ColumnTitle(name)
    joints = [unquote(part) for part in parts]
    own = words.get(joints[0])
    signs = "" if own is None or kind.startswith("power") else own.signs
    shown = shown_joints(joints, words)
    if kind == NET:
        shown = (shown[0], label_of(parts[1], words))
    if FORCE.fullmatch(unit):
        template = template.replace("torque", "force")
    return ColumnTitle(template.format(*shown), signs)
