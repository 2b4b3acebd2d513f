"""Reader of SDFormat models, Gazebo's; other content than dynamics is noted. Meshes are never opened.

A joint whose child another joint carries already closes a loop: it is cut and becomes a constraint, at the
place and along the axis that it has at q = 0, which is how the file shows the model. A root that no joint
holds to the world is free, as in SDFormat. A link that is called `world` is the world.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.description import ZERO3, Body, Description, FreeRoot, Site
from linkwise.robot.readers.sdf.joints import SdfJoint, sdf_joints
from linkwise.robot.readers.sdf.poses import (
    WORLD,
    ModelPoses,
    Pose,
    is_true,
    numbers_in,
    numbers_of,
    place_of,
    pose_in,
    relative_to,
    text_of,
)
from linkwise.robot.readers.sdf.unmodelled import known, omissions
from linkwise.robot.readers.xml_file import parse
from linkwise.robot.readers.xml_names import ignored
from linkwise.robot.robot import Vec3

OF_WORLD = (0.0, 0.0, -9.8)
"""Gravity, in m/s², of a world that does not give it."""
DOWN = (0.0, 0.0, -9.81)
"""Gravity, in m/s², of a model on its own, as for a URDF file."""
GRAVITY = ("gravity", "physics/gravity")


def read_sdf(path: Path) -> Description:
    """Return the description of a robot; raises LinkwiseError naming the element and the remedy."""
    root = parse(path)
    if root.tag != "sdf":
        raise LinkwiseError(f"the root element is <{root.tag}>; an SDFormat file has <sdf>")
    version, model = _version(root), _model(root)
    links, joints = model.findall("link"), model.findall("joint")
    links = [link for link in links if link.get("name") != WORLD]
    if not links:
        raise LinkwiseError(f"the model {model.get('name')!r} has no <link>; give one that has some")
    notes, poses = ignored([root], known, "SDFormat"), ModelPoses(model, version)
    tree, loops = sdf_joints(joints, poses, version)
    held = any(joint.parent == WORLD for joint in (*tree, *loops))
    places = {joint.child: joint.in_child.translation for joint in tree}
    losses = (
        *(loss for j in tree for loss in j.losses(False)),
        *(loss for j in loops for loss in j.losses(True)),
    )
    return Description(
        model.get("name") or path.stem,
        (*((Body(WORLD),) if held else ()), *(_body(link, places) for link in links)),
        tuple(joint.connection() for joint in tree),
        _gravity(root),
        notes=notes,
        ties=tuple(joint.tie() for joint in loops),
        sites=tuple(_site(frame, poses) for frame in model.findall("frame")),
        omissions=(*omissions(links, joints), *losses),
        ground=WORLD if held else "",
        free=None if held else _free(links, tree, poses),
    )


def _version(root: Element) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,4})\.(\d{1,4})(\..*)?", root.get("version", ""))
    if not found:
        raise LinkwiseError(f"<sdf version={root.get('version')!r}>; give the format's version, such as 1.9")
    return int(found[1]), int(found[2])


def _model(root: Element) -> Element:
    """Return the one model of the file; raises LinkwiseError for others, and for parts in other files."""
    models = [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1:
        names = listed(repr(model.get("name")) for model in models)
        raise LinkwiseError(f"the file has {len(models)} models{f' ({names})' if names else ''}; keep one")
    (model,) = models
    if root.find("world/joint") is not None:
        raise LinkwiseError("the world has a <joint>; write it in the model, with the parent world")
    for tag in ("include", "model"):
        if model.find(tag) is not None:
            raise LinkwiseError(
                f"the model {model.get('name')!r} has a <{tag}>; write all in one model, without others in it"
            )
    if is_true(text_of(model, "static"), "<static>", place_of(model)):
        raise LinkwiseError(f"the model {model.get('name')!r} is <static>, and never moves; remove that")
    return model


def _body(link: Element, places: Mapping[str, Vec3]) -> Body:
    """Return a link, with the place of its joint on it.

    Raises LinkwiseError for mass properties that the file leaves to SDFormat's defaults or to Gazebo.
    """
    name, place = link.get("name", ""), place_of(link)
    inertial = link.find("inertial")
    if inertial is None:
        raise LinkwiseError(
            f"{place} has no <inertial>, which SDFormat takes for 1 kg and 1 kg m²; write it out"
        )
    if is_true(inertial.get("auto", ""), "<inertial auto>", place):
        raise LinkwiseError(
            f"{place}: <inertial auto> is worked out of shapes by Gazebo; write the numbers out"
        )
    for path in ("mass", *(f"inertia/i{axis}" for axis in ("xx", "yy", "zz"))):
        if inertial.find(path) is None:
            raise LinkwiseError(f"{place}: <inertial> has no <{path.rpartition('/')[2]}>; write it out")
    xx, yy, zz, xy, xz, yz = (
        numbers_in(inertial, f"inertia/i{key}", 0.0, place) for key in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    com = _pose_of_inertia(inertial, name, place)
    turned = transforms.rotate_inertia(com.rotation, ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    origin = transforms.minus(places.get(name, ZERO3))
    return Body(name, numbers_in(inertial, "mass", 0.0, place), com.translation, turned, origin=origin)


def _pose_of_inertia(inertial: Element, link: str, place: str) -> Pose:
    """Return the pose of a link's inertia in the link; raises LinkwiseError for a pose in another frame."""
    relative = relative_to(inertial)
    if relative not in ("", link):
        raise LinkwiseError(
            f"{place}: the pose of <inertial> is relative to {relative!r}, which SDFormat does not have; "
            "write it in the link's axes"
        )
    return pose_in(inertial, place)


def _free(links: Iterable[Element], tree: Sequence[SdfJoint], poses: ModelPoses) -> FreeRoot | None:
    """Return the pose at which the file shows the link that no joint carries; None if there is none."""
    carried = {joint.child for joint in tree}
    root = next((link for link in links if link.get("name") not in carried), None)
    if root is None:
        return None
    shown = poses.of_model().times(poses.of(root))
    return FreeRoot(shown.rotation, shown.translation)


def _gravity(root: Element) -> Vec3:
    """Return gravity in the world's axes, in m/s²; before version 1.6 it stood in the world's <physics>."""
    world = root.find("world")
    if world is None:
        return DOWN
    told = next((found for path in GRAVITY if (found := world.find(path)) is not None), None)
    x, y, z = OF_WORLD if told is None else numbers_of(told, 3, "the world")
    return x, y, z


def _site(frame: Element, poses: ModelPoses) -> Site:
    name, place = frame.get("name", ""), place_of(frame)
    link = poses.link_of(name, place)
    seen = poses.named(link, place).inverse().times(poses.of(frame))
    return Site(name, link, seen.rotation, seen.translation)
