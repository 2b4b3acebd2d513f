"""An MJCF file with other inertias and friction."""

from collections.abc import Iterable, Iterator, Mapping
from xml.etree.ElementTree import Element

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.identification.own_file import Friction, LinkMass, NotWrittenBack, OwnFile
from linkwise.identification.placed_xml import Edit, PlacedXml, tag
from linkwise.robot.description import Body
from linkwise.robot.readers.mjcf.files import mjcf_files
from linkwise.robot.readers.mjcf.reader import body_name, joint_name, read_mjcf

AXES = ("fullinertia", "quat", "axisangle", "euler", "xyaxes", "zaxis")
"""Attributes of <inertial> that `diaginertia` and `quat` replace."""
FRICTION = {"damping": "damping", "friction": "frictionloss"}
NEAR = 1e-9
"""Part of a body's mass and moments, by which MuJoCo's reading of them may differ from what was written."""


class OwnMjcf(OwnFile):
    """An MJCF file with new numbers in <inertial>, added where geoms gave a body its mass, and in <joint>."""

    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the edited file, see OwnFile."""
        xml = PlacedXml(self.data)
        edits: list[Edit] = []
        for name, body in self._bodies(xml.root).items():
            if (carried := links.get(name)) is not None:
                edits += _inertial(xml, body, carried)
            joints = list(_inside(body, "joint"))
            for at, joint in enumerate(joints):
                if rubs := friction.get(joint_name(joint.get("name", ""), name, at, len(joints))):
                    edits += xml.with_attributes(joint, {FRICTION[what]: text for what, text in rubs.items()})
        text = xml.apply_edits(edits)
        self._read_again(text, links, friction)
        return text

    def lost(self, friction: Mapping[str, Array]) -> Iterator[str]:
        """Yield what OwnFile does; meshes and included files are found by paths from the file's folder."""
        yield from super().lost(friction)
        files = mjcf_files(self.path)
        if files.others or len(files.documents) > 1:
            yield (
                f"{self.path.name} reads other files, by paths from its own folder: put it there, under "
                "another name, for MuJoCo to find them"
            )

    def _bodies(self, root: Element) -> dict[str, Element]:
        """Return elements by the names of their bodies.

        Raises NotWrittenBack where not every body has an element of its own.
        """
        found: dict[str, Element] = {}
        for body in _bodies_in(root.findall("worldbody")):
            found[body_name(body.get("name", ""), len(found) + 1)] = body
        _, *bodies = (body.name for body in self.description.bodies if not body.invented)
        if list(found) != bodies:
            raise NotWrittenBack(
                f"{self.path.name} includes, attaches or repeats bodies that stand elsewhere; to have a file "
                "with its bodies written back, give that"
            )
        return found

    def _read_again(self, text: bytes, links: Mapping[str, LinkMass], friction: Friction) -> None:
        """Raise NotWrittenBack where MuJoCo reads from the file something else than was written."""
        try:
            again = read_mjcf(self.path, text)
        except LinkwiseError as error:
            raise NotWrittenBack(f"{self.path.name} would not compile: {error}") from None
        for body in again.bodies:
            if body.name in links and not _is_near(body, links[body.name]):
                raise NotWrittenBack(
                    f"{self.path.name} has settings under which MuJoCo changes the mass of {body.name!r}, "
                    "such as inertiafromgeom, settotalmass or boundinertia of <compiler>; take them away"
                )
        for joint in again.connections:
            rubs = friction.get(joint.name, {})
            if any(getattr(joint.passive, what) != float(text) for what, text in rubs.items()):
                raise NotWrittenBack(
                    f"{self.path.name} has settings under which joint {joint.name!r} rubs otherwise than its "
                    "numbers say, such as flags of <option>; take them away"
                )


def _inertial(xml: PlacedXml, body: Element, carried: LinkMass) -> list[Edit]:
    """Return edits of <inertial>, by principal axes: these express bodies flat in a direction too."""
    second = 0.5 * np.trace(carried.inertia) * np.eye(3) - carried.inertia
    sizes, axes = np.linalg.eigh(second)
    x, y, z = np.maximum(sizes, 0.0)
    axes *= np.sign(np.linalg.det(axes))
    quaternion = np.zeros(4)
    extra("mujoco").mju_mat2Quat(quaternion, axes.reshape(-1))
    values: dict[str, str] = {
        "pos": _text(carried.com),
        "mass": repr(carried.mass),
        "diaginertia": _text([y + z, x + z, x + y]),
        "quat": _text(quaternion),
    }
    inertial = body.find("inertial")
    if inertial is None:
        return [xml.with_children(body, [tag("inertial", values)])]
    return xml.with_attributes(inertial, {**dict.fromkeys(AXES), **values})


def _text(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _is_near(body: Body, wanted: LinkMass) -> bool:
    moments = np.array(body.inertia, dtype=float)
    largest = float(np.trace(wanted.inertia)) + wanted.mass * float(wanted.com @ wanted.com)
    return (
        abs(float(body.mass) - wanted.mass) <= NEAR * wanted.mass
        and bool(np.allclose(np.array(body.com, dtype=float), wanted.com, rtol=NEAR, atol=NEAR))
        and float(abs(moments - wanted.inertia).max()) <= NEAR * largest
    )


def _inside(holder: Element, what: str) -> Iterator[Element]:
    """Yield elements of a body, also those in its <frame>s, in the file's order."""
    for element in holder:
        if element.tag == what:
            yield element
        elif element.tag == "frame":
            yield from _inside(element, what)


def _bodies_in(holders: Iterable[Element]) -> Iterator[Element]:
    """Yield every body, parents first, in MuJoCo's order."""
    for holder in holders:
        for body in _inside(holder, "body"):
            yield body
            yield from _bodies_in([body])
