"""An OpenSim model with other inertias; the format has no place for friction."""

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

from linkwise.identification.own_file import Friction, LinkMass, OwnFile
from linkwise.identification.placed_xml import Edit, PlacedXml
from linkwise.robot.readers.osim.document import as_xml, members, name_of
from linkwise.robot.readers.osim.reader import ENTRIES


class OwnOsim(OwnFile):
    """An OpenSim model with new numbers in <mass>, <mass_center> and <inertia>."""

    without_friction = ", as no joint of OpenSim has any"

    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the edited file, see OwnFile."""
        repaired = as_xml(self.data)
        if len(repaired) != len(self.data):
            raise self.not_utf8()
        xml = PlacedXml(self.data, repaired)
        model = xml.root.find("Model")
        assert model is not None
        bodies = ((body, links.get(name_of(body))) for body in members(model, "BodySet"))
        edits = [edit for body, own in bodies if own is not None for edit in _body(xml, body, own)]
        return xml.apply_edits(edits)

    def has_friction(self, joint: str) -> bool:
        """Return False: no joint has a place for friction."""
        return False


def _body(xml: PlacedXml, body: Element, carried: LinkMass) -> Iterator[Edit]:
    moments = [repr(float(carried.inertia["xyz".index(e[0]), "xyz".index(e[1])])) for e in ENTRIES]
    values = {"mass": repr(carried.mass), "mass_center": " ".join(map(repr, carried.com.tolist()))}
    if body.find("inertia_xx") is None or body.find("inertia") is not None:
        values["inertia"] = " ".join(moments)
    else:
        values |= {f"inertia_{entry}": text for entry, text in zip(ENTRIES, moments, strict=True)}
    for key, text in values.items():
        if (element := body.find(key)) is not None:
            yield xml.with_text(element, text)
    if missing := [f"<{key}>{text}</{key}>" for key, text in values.items() if body.find(key) is None]:
        yield xml.with_children(body, missing)
