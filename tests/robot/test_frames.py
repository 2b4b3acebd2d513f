"""Frames that a robot has by name: bodies of the file, also those merged away, and sites."""

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.urdf_text import joint, link, robot
from linkwise import Options, read_system
from linkwise.robot.robot import Robot
from linkwise.symbolic.definition import joint_tree
from linkwise.symbolic.system import RigidSystem, rigid_system

ARM = robot(
    *map(link, "abc"),
    '<link name="tool"/><link name="stand"/><link name="tip"/>',
    joint("ab", "a", "b", axis="0 0 1"),
    joint("bt", "b", "tool", type="fixed", xyz="0.1 0.2 0.3", rpy="0 0 0"),
    joint("bc", "b", "c"),
    joint("as", "a", "stand", type="fixed"),
    joint("ctip", "c", "tip", type="fixed"),
)


def read(path: Path, text: str, **options: object) -> Robot:
    path.write_text(text)
    system = read_system(path, Options(**options))  # type: ignore[arg-type]
    assert isinstance(system, RigidSystem)
    return system.robot


def test_every_body_of_the_file_has_a_frame_wherever_it_went(tmp_path: Path) -> None:
    found = read(tmp_path / "arm.urdf", ARM)
    on = {frame.name: None if frame.link is None else found.links[frame.link].name for frame in found.frames}
    assert on == {"a": None, "stand": None, "b": "b", "tool": "b", "c": "c", "tip": "c"}
    tool = next(frame for frame in found.frames if frame.name == "tool")
    assert tool.translation == (0.1, 0.2, 0.3)


def test_frames_of_a_robot_that_was_given_none_are_those_of_its_links(tmp_path: Path) -> None:
    found = replace(read(tmp_path / "arm.urdf", ARM), frames=())
    upright = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    given = [(frame.name, frame.link, frame.rotation, frame.translation) for frame in found.named_frames]
    assert given == [(link.name, at, upright, (0, 0, 0)) for at, link in enumerate(found.links)]


def test_links_between_the_axes_of_one_joint_have_frames_too(tmp_path: Path) -> None:
    found = read(tmp_path / "arm.urdf", ARM, base="floating")
    names = {frame.name: frame.link for frame in found.frames}
    assert {link.name for link in found.links} <= names.keys()
    assert names["stand"] == names["a"]
    assert "a_yaw" in names


def test_frames_of_what_was_cut_away_are_gone(tmp_path: Path) -> None:
    found = read(tmp_path / "arm.urdf", ARM, tip="b")
    assert [frame.name for frame in found.frames] == ["a", "b"]


def test_a_files_own_parameters_stay_formulas_of_its_frames(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(
        """schema = 1
name = "arm"
gravity = [0, -9.81, 0]
parameters = {L = 0.4, reach = 0.3}
joint = [
  {name = "j1", type = "revolute", parent = "base", child = "one"},
  {name = "f1", type = "fixed", parent = "one", child = "tool", xyz = ["2*L", "reach", 0]},
]
link = [
  {name = "base"},
  {name = "one", mass = 1, com = ["L", 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
  {name = "tool"},
]
"""
    )
    system = read_system(path, Options("symbolic"))
    assert isinstance(system, RigidSystem)
    x, y, _ = next(frame.translation for frame in system.robot.frames if frame.name == "tool")
    assert str(x) == "2.0*L"
    assert y == 0.3  # it moves no torque, and so is not a run-time parameter


def test_sites_are_frames_unless_a_body_has_their_name(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    found = read(
        tmp_path / "arm.xml",
        """<mujoco model="arm"><worldbody><site name="origin"/><body name="arm">
        <joint name="turn" axis="0 1 0"/><geom size="0.1" mass="1"/><site name="arm" pos="1 0 0"/>
        <body name="hand" pos="0.3 0 0"><geom size="0.1" mass="1"/>
        <site name="grip" pos="0 0 0.2"/><site/></body>
        </body></worldbody></mujoco>""",
    )
    on = {frame.name: frame.link for frame in found.frames}
    assert on == {"world": None, "origin": None, "arm": 0, "hand": 0, "grip": 0}
    doubles = [note for note in found.notes if note.subject == "arm"]
    assert [note.detail for note in doubles] == ["a site whose name another frame has"]


def test_a_robot_made_in_python_has_a_frame_for_each_link(tmp_path: Path) -> None:
    found = read(tmp_path / "arm.urdf", ARM)
    made = replace(found, frames=())
    assert [(frame.name, frame.link) for frame in made.named_frames] == [("b", 0), ("c", 1)]
    tree = joint_tree(rigid_system(made))
    assert tree is not None
    assert [frame.name for frame in tree.frames] == ["b", "c"]
