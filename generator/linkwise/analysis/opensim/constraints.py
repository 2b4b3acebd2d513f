"""The constraints that OpenSim's InducedAccelerations has in place of external forces, as contacts.

OpenSim moves each to where its external force acts, and has it on while that force is above a threshold; a
contact is so while loads are measured on its body.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.description import Anchor
from linkwise.robot.readers.osim.constraints import anchor_of, is_enforced
from linkwise.robot.readers.osim.document import name_of, numbers_of, text_of
from linkwise.robot.readers.osim.frames import GROUND, Frames, Placed
from linkwise.robot.readers.osim.reader import EARTH

ROLLS, POINT, WELD = "RollingOnSurfaceConstraint", "PointConstraint", "WeldConstraint"
KINDS = {ROLLS: "pressed", POINT: "pressed-point", WELD: "held"}
"""Kind of contact that each constraint is where its external force acts."""
SURFACES = ("rolling_body", "surface_body")
ALONG = 1e-6
"""Largest sine of the angle between a surface's normal and gravity: the ground is level here."""


@dataclass(frozen=True)
class AsContacts:
    """Options of contacts and loads by their keys, and lines on what is left out."""

    options: dict[str, Any] = field(default_factory=dict)
    told: tuple[str, ...] = ()


def as_contacts(analysis: Element, model: Element, loads: Path | None, threshold: float) -> AsContacts:
    """Return the contacts that an analysis has in place of external loads.

    model: gets the constraints, so that their frames are found; threshold: force in N

    Raises LinkwiseError for constraints of other kinds, between bodies, or on ground that is not level.
    """
    given = list(analysis.iterfind("ConstraintSet/objects/*"))
    if loads is None:
        given = [one for one in given if is_enforced(one)]
    if not given:
        return AsContacts({} if loads is None else {"loads": (str(loads),)}, tuple(_as_sources(loads)))
    _into(model, given)
    frames, told = Frames(model), []
    contacts = [_contact(one, frames, model, loads) for one in given]
    if any(one.tag == ROLLS for one in given):
        told.append(f"{ROLLS}: what it holds doesn't slip, whatever its friction_coefficient")
    measured = {} if loads is None else {"contact_loads": (str(loads),), "contact_threshold": threshold}
    return AsContacts({"contact": contacts, **measured}, tuple(told))


def _as_sources(loads: Path | None) -> Iterator[str]:
    if loads is not None:
        yield f"{loads.name}: no constraint takes the place of its forces, which are sources of their own"


def _into(model: Element, constraints: list[Element]) -> None:
    held = model.find("ConstraintSet")
    held = SubElement(model, "ConstraintSet") if held is None else held
    there = held.find("objects")
    (SubElement(held, "objects") if there is None else there).extend(constraints)


def _contact(one: Element, frames: Frames, model: Element, loads: Path | None) -> str:
    """Return a contact as `--contact` has it."""
    place = f"{one.tag} {name_of(one)!r}"
    if one.tag not in KINDS:
        raise LinkwiseError(f"{place} takes the place of no external force; {listed(KINDS)} do")
    ends = _ends(one, frames)
    bodies = [end for end in ends if end.body != GROUND]
    if len(bodies) != 1:
        raise LinkwiseError(f"{place} is between {' and '.join(end.body for end in ends)}; one is ground")
    (foot,) = bodies
    kind = KINDS[one.tag]
    if one.tag == ROLLS:
        _check_level(one, model, place)
        if loads is None:
            raise LinkwiseError(f"{place} needs an external_loads_file, which says where it presses")
    if one.tag == POINT and loads is None:
        kind = "point"
    at = f"@{','.join(map(repr, foot.translation))}" if one.tag != ROLLS and any(foot.translation) else ""
    name = name_of(one) or foot.body
    return f"{name}:{foot.body}={kind}{at}"


def _ends(one: Element, frames: Frames) -> list[Placed] | list[Anchor]:
    """Return the frames at both ends of a constraint."""
    if one.tag != ROLLS:
        return [anchor_of(one, number, frames) for number in (1, 2)]
    names = [text_of(one, f"socket_{end}") or text_of(one, end, GROUND) for end in SURFACES]
    return [frames.found(name, one) for name in names]


def _check_level(one: Element, model: Element, place: str) -> None:
    normal = np.array(numbers_of(one, "surface_normal", "0 1 0", place, 3))
    gravity = np.array(numbers_of(model, "gravity", EARTH, "the model", 3))
    sizes = np.linalg.norm(normal) * np.linalg.norm(gravity)
    if not sizes or -normal @ gravity < sizes * (1.0 - ALONG):
        raise LinkwiseError(
            f"{place}: its surface_normal {' '.join(f'{part:g}' for part in normal)} is not against gravity;"
            " the ground is level here"
        )
