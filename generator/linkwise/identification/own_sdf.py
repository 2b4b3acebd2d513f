"""An SDFormat file with other inertias and friction."""

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

import numpy as np

from linkwise.identification.own_file import Friction, LinkMass, OwnFile
from linkwise.identification.own_urdf import moments
from linkwise.identification.placed_xml import Edit, PlacedXml
from linkwise.robot.readers.sdf.poses import pose_in


class OwnSdf(OwnFile):
    """An SDFormat file with new numbers in <inertial>, whose axes stay, and in <dynamics>."""

    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the edited file, see OwnFile."""
        xml = PlacedXml(self.data)
        edits: list[Edit] = []
        for link in xml.root.iter("link"):
            inertial, carried = link.find("inertial"), links.get(link.get("name", ""))
            if inertial is not None and carried is not None:
                edits += _inertial(xml, inertial, carried)
        for joint in xml.root.iter("joint"):
            if rubs := friction.get(joint.get("name", "")):
                edits += _dynamics(xml, joint, rubs)
        return xml.apply_edits(edits)


def _inertial(xml: PlacedXml, inertial: Element, carried: LinkMass) -> Iterator[Edit]:
    values = moments(carried, np.array(pose_in(inertial, "").rotation, dtype=float))
    pose, com = inertial.find("pose"), list(map(repr, carried.com.tolist()))
    if pose is None:
        yield xml.with_children(inertial, [f"<pose>{' '.join(com)} 0 0 0</pose>"])
    else:
        turn = (pose.text or "").split()[3:] or ["0"] * 3
        yield xml.with_text(pose, " ".join([*com, *turn]))
    yield from _numbers(xml, inertial, {"mass": repr(carried.mass)})
    inertia = inertial.find("inertia")
    assert inertia is not None
    # A moment that is missing is 0.
    there = {key: text for key, text in values.items() if float(text) or inertia.find(key) is not None}
    yield from _numbers(xml, inertia, there)


def _dynamics(xml: PlacedXml, joint: Element, rubs: Mapping[str, str]) -> Iterator[Edit]:
    axis, dynamics = joint.find("axis"), joint.find("axis/dynamics")
    new = "".join(_written(key, text) for key, text in rubs.items())
    if dynamics is not None:
        yield from _numbers(xml, dynamics, rubs)
    elif axis is not None:
        yield xml.with_children(axis, [f"<dynamics>{new}</dynamics>"])
    else:
        yield xml.with_children(joint, [f"<axis><dynamics>{new}</dynamics></axis>"])


def _numbers(xml: PlacedXml, parent: Element, values: Mapping[str, str]) -> Iterator[Edit]:
    """Yield edits of the texts of an element's own elements; missing elements are added."""
    there = {key: parent.find(key) for key in values}
    for key, element in there.items():
        if element is not None:
            yield xml.with_text(element, values[key])
    if missing := [_written(key, values[key]) for key, element in there.items() if element is None]:
        yield xml.with_children(parent, missing)


def _written(key: str, text: str) -> str:
    return f"<{key}>{text}</{key}>"
