"""Bodies to which several joints lead, which closes loops: parted as OpenSim parts them.

Each joint carries an equal part of such a body, with an equal part of its mass and inertia, and welds hold
the parts together (M. Sherman, A. Seth, S. Delp, Simbody: multibody dynamics for biomedical research, 2011).
So every joint keeps its coordinates, and torques of the open tree are those of OpenSim's inverse dynamics.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from linkwise.robot import transforms
from linkwise.robot.description import Anchor, AnchoredTie, Body
from linkwise.robot.notes import Note
from linkwise.robot.readers.osim.joints import OsimJoint

PARTED = "carried by several joints: an equal part of it at each, as in OpenSim, welded to the first"


@dataclass(frozen=True)
class PartedBodies:
    """All joints, each to a body or to a part of one, and the body of each part by the part's name."""

    joints: tuple[OsimJoint, ...]
    parts: dict[str, str]

    def bodies(self, whole: Iterable[Body]) -> Iterator[Body]:
        """Yield the bodies, and behind each the other parts of it."""
        of_part = {joint.child.body: joint for joint in self.joints}
        counts = Counter(self.parts.values())
        for body in whole:
            share = 1.0 / (1 + counts[body.name])
            moments = (tuple(share * entry for entry in row) for row in body.inertia)
            x, y, z = ((a, b, c) for a, b, c in moments)
            part = replace(body, mass=share * body.mass, inertia=(x, y, z)) if counts[body.name] else body
            yield part
            for name in (name for name, of in self.parts.items() if of == body.name):
                origin = transforms.minus(of_part[name].child.translation)
                yield replace(part, name=name, origin=origin)

    def welds(self) -> Iterator[AnchoredTie]:
        """Yield what holds the parts together."""
        for name, body in self.parts.items():
            yield AnchoredTie(f"weld_{name}", "frame", Anchor(body), Anchor(name))

    def notes(self) -> Iterator[Note]:
        """Yield a note on each part beside the first."""
        for name, body in self.parts.items():
            yield Note("warned", body, f"its part {name}", PARTED)


def with_parted_bodies(
    ordered: tuple[tuple[OsimJoint, ...], tuple[OsimJoint, ...]], names: Iterable[str]
) -> PartedBodies:
    """Return the joints of the tree and those beside it, which lead to parts of bodies.

    ordered: both, as `from_ground` gives them; names: names of the bodies, of which no part has one
    """
    tree, beside = ordered
    taken, parts, joints = set(names), {}, list(tree)
    for joint in beside:
        name = f"{joint.child.body}_{joint.name}"
        while name in taken:
            name += "_"
        taken.add(name)
        parts[name] = joint.child.body
        joints.append(replace(joint, child=replace(joint.child, body=name)))
    return PartedBodies(tuple(joints), parts)
