"""A URDF file with other inertias and friction."""

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import MOMENTS

from linkwise.arrays import Array
from linkwise.identification.own_file import Friction, LinkMass, OwnFile
from linkwise.identification.placed_xml import Edit, PlacedXml, tag
from linkwise.robot.readers.xml_file import numbers
from linkwise.robot.transforms import from_rpy

KEYS = tuple(f"i{'xyz'[a]}{'xyz'[b]}" for a, b in MOMENTS)
"""Keys of an inertia's numbers, in the order of MOMENTS, in SDFormat as well."""


class OwnUrdf(OwnFile):
    """A URDF file with new numbers in <inertial>, whose axes stay, and in <dynamics>."""

    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the edited file, see OwnFile."""
        xml = PlacedXml(self.data)
        edits: list[Edit] = []
        for link in xml.root.findall("link"):
            inertial, carried = link.find("inertial"), links.get(link.get("name", ""))
            if inertial is not None and carried is not None:
                edits += _inertial(xml, inertial, carried)
        for joint in xml.root.findall("joint"):
            if rubs := friction.get(joint.get("name", "")):
                edits += _dynamics(xml, joint, rubs)
        return xml.apply_edits(edits)


def moments(carried: LinkMass, turn: Array) -> dict[str, str]:
    """Return the moments by key, in axes that `turn` (3, 3) rotates to the link's."""
    inertia = turn.T @ carried.inertia @ turn
    return {key: repr(float(inertia[at])) for key, at in zip(KEYS, MOMENTS, strict=True)}


def _inertial(xml: PlacedXml, inertial: Element, carried: LinkMass) -> Iterator[Edit]:
    origin = inertial.find("origin")
    rpy = (0.0, 0.0, 0.0) if origin is None else numbers(origin, "rpy", "0 0 0", 3, "")
    values = {
        "origin": {"xyz": " ".join(map(repr, carried.com.tolist()))},
        "mass": {"value": repr(carried.mass)},
        "inertia": moments(carried, np.array(from_rpy(*rpy))),
    }
    for name, own in values.items():
        if (element := inertial.find(name)) is not None:
            yield from xml.with_attributes(element, own)
        else:
            yield xml.with_children(inertial, [tag(name, own)])


def _dynamics(xml: PlacedXml, joint: Element, rubs: Mapping[str, str]) -> list[Edit]:
    """Return edits of a joint's friction; of several <dynamics>, the last one counts."""
    there = joint.findall("dynamics")
    if there:
        return xml.with_attributes(there[-1], rubs)
    return [xml.with_children(joint, [tag("dynamics", rubs)])]
