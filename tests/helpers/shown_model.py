"""An SDFormat model by the format's own rules of frames: http://sdformat.org/tutorials?tut=pose_frame_semantics.

Its poses at q = 0 are the file's; from there each joint moves what it carries along its screw in the world.
"""

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation


class ShownModel:
    """Poses of links and frames in the world, (4, 4), and what gravity and forces ask of the joints."""

    def __init__(self, text: str) -> None:
        model = ET.fromstring(text).find("model")
        assert model is not None
        self.model = model
        self.elements = {
            e.get("name", ""): e for tag in ("link", "joint", "frame") for e in model.findall(tag)
        }
        self.frames = [name for name, e in self.elements.items() if e.tag in ("link", "frame")]
        self._first = model.findall("link")[0].get("name", "")
        placed = model.get("placement_frame")
        of_frame = np.eye(4) if placed is None else self._in_model(placed)
        self.of_model = _pose(model) @ np.linalg.inv(of_frame)
        self.above = {self._link(e.findtext("child", "")): e for e in model.findall("joint")}
        moving = [e.get("name") for e in model.findall("joint") if e.get("type") != "fixed"]
        self.number = {name: k for k, name in enumerate(moving)}

    def poses(self, q: Any) -> dict[str, Any]:
        """Pose of each link and frame with the joints at q, in the file's order of joints."""
        return {name: self._moved(self._link(name), q) @ self._shown(name) for name in self.frames}

    def load_torque(self, q: Any, frame: str, point: Any, force: Any) -> Any:
        """Return the torques that a force at a place in a frame, both in the world's axes at last, asks of
        the joints."""

        def work(q: Any) -> float:
            return float(force @ (self.poses(q)[frame] @ [*point, 1.0])[:3])

        return _gradient(work, q)

    def gravity_torque(self, q: Any) -> Any:
        """Return the torques that holding the weight asks of the joints."""

        def potential(q: Any) -> float:
            total = 0.0
            for link, pose in self.poses(q).items():
                inertial = self.elements[link].find("inertial")
                if inertial is not None:
                    total += float(inertial.findtext("mass", "")) * 9.81 * (pose @ _pose(inertial))[2, 3]
            return total

        return _gradient(potential, q)

    def _shown(self, name: str) -> Any:
        return self.of_model @ self._in_model(name)

    def _in_model(self, name: str) -> Any:
        if name == "__model__":
            return np.eye(4)
        if name == "world":
            return np.linalg.inv(self.of_model)
        element = self.elements[name]
        pose = element.find("pose")
        usual = {"joint": element.findtext("child"), "frame": element.get("attached_to")}.get(element.tag)
        before = (pose.get("relative_to") if pose is not None else None) or usual or "__model__"
        return self._in_model(before) @ _pose(element)

    def _link(self, name: str) -> str:
        while name != "world" and self.elements[name].tag != "link":
            element = self.elements[name]
            carrier = element.findtext("child") if element.tag == "joint" else element.get("attached_to")
            name = carrier or self.model.get("canonical_link") or self._first
        return name

    def _moved(self, link: str, q: Any) -> Any:
        """Return the motion of a link by the joints above it, from where it is at q = 0."""
        joint = self.above.get(link)
        if joint is None:
            return np.eye(4)
        before = self._moved(self._link(joint.findtext("parent", "")), q)
        moving = joint.get("type") != "fixed"
        return before @ expm(q[self.number[joint.get("name")]] * self._screw(joint)) if moving else before

    def _screw(self, joint: Any) -> Any:
        xyz = joint.find("axis/xyz")
        seen_in = xyz.get("expressed_in") or joint.get("name")
        axis = self._shown(seen_in)[:3, :3] @ np.array(xyz.text.split(), dtype=float)
        axis, screw = axis / np.linalg.norm(axis), np.zeros((4, 4))
        if joint.get("type") == "prismatic":
            screw[:3, 3] = axis
        else:
            screw[:3, :3] = np.cross(np.eye(3), axis)  # its product with v is axis x v
            screw[:3, 3] = -np.cross(axis, self._shown(joint.get("name"))[:3, 3])
        return screw


def _pose(element: Any) -> Any:
    found = element.find("pose")
    numbers = [float(word) for word in ((found.text if found is not None else "") or "").split()] or [0.0] * 6
    pose = np.eye(4)
    pose[:3, 3] = numbers[:3]
    if len(numbers) == 7:
        pose[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    else:
        in_degrees = found is not None and found.get("degrees") == "true"
        pose[:3, :3] = Rotation.from_euler("xyz", numbers[3:], degrees=in_degrees).as_matrix()
    return pose


def _gradient(function: Any, q: Any) -> Any:
    step = 1e-5
    moved = ((function(q + step * e) - function(q - step * e)) / (2 * step) for e in np.eye(len(q)))
    return np.array(list(moved))
