"""Every joint type, mimic, tree and option against Pinocchio, sums and each link's own torque."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states, relative_error
from helpers.urdf_text import chain, joint, link, mimic, robot
from linkwise import Options, generate, read_robot, read_system, write_package
from linkwise.package.load import import_package
from linkwise.robot import effects

pytest.importorskip("pinocchio")

import pinocchio as pin
from numeric.pinocchio_model import PinocchioModel

AB, BC, CD = (joint(a + b, a, b) for a, b in ("ab", "bc", "cd"))
SLIDE = joint("bc", "b", "c", type="prismatic", axis="1 -2 0.5")
TREE = robot(
    *map(link, "abcdef"), AB, SLIDE, joint("ad", "a", "d"), joint("de", "d", "e"), joint("df", "d", "f")
)
BARE = robot(
    link("a"),
    link("b").replace('<origin xyz="0.1 -0.02 0.05" rpy="0.1 0.2 0.3"/>', '<origin xyz="0.1 -0.02 0.05"/>'),
    link("c").replace('<origin xyz="0.1 -0.02 0.05" rpy="0.1 0.2 0.3"/>', ""),
    link("d"),
    AB.replace('<axis xyz="0 0.6 0.8"/>', "").replace(' rpy="0.4 -0.3 0.2"', ""),
    BC.replace('<origin xyz="0.2 0.1 0.3" rpy="0.4 -0.3 0.2"/>', ""),
    joint("cd", "c", "d", inner='<mimic joint="ab"/>').replace('xyz="0.2 0.1 0.3" ', ""),
)
"""Robot with the least that a file must say."""
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "defaults": (BARE, {}),
    "revolute": (chain(AB, BC), {}),
    "continuous": (chain(AB, joint("bc", "b", "c", type="continuous", axis="0 0 -1")), {}),
    "negative axes": (
        chain(
            *(
                joint(f"j{k}", "abc"[k], "bcd"[k], axis=a)
                for k, a in enumerate(("-1 0 0", "0 -3 0", "0 0 -1"))
            )
        ),
        {},
    ),
    "prismatic": (chain(AB, SLIDE, CD), {}),
    "fixed between": (chain(AB, joint("bc", "b", "c", type="fixed"), CD), {}),
    "tree": (TREE, {}),
    "mimic": (chain(AB, joint("bc", "b", "c", inner=mimic("ab", -1.7, 0.4)), CD), {}),
    "mimic before its master": (chain(joint("ab", "a", "b", inner=mimic("cd", 0.5, 0.1)), BC, CD), {}),
    "prismatic mimic": (
        chain(AB, joint("bc", "b", "c", type="prismatic", inner=mimic("ab", 0.3, -0.2)), CD),
        {},
    ),
    "mimic of a slide": (chain(AB, SLIDE, joint("cd", "c", "d", inner=mimic("bc", 2.0, 1.0))), {}),
    "mimic across branches": (
        robot(*map(link, "abcd"), AB, joint("ac", "a", "c", inner=mimic("ab", -1.0)), joint("cd", "c", "d")),
        {},
    ),
    "mimic let free": (chain(AB, joint("bc", "b", "c", inner=mimic("moon", 3.0, 1.0))), {"free_mimic": True}),
    "locked": (chain(AB, SLIDE, CD), {"lock": {"bc": 0.35}}),
    "locked turn": (chain(AB, BC, CD), {"lock": {"bc": -0.8, "ab": 0.3}}),
    "locked master": (
        chain(AB, joint("bc", "b", "c", inner=mimic("ab", 2.0, 0.3)), CD),
        {"lock": {"ab": 0.4}},
    ),
    "floating base": (chain(AB, BC), {"base": "floating"}),
    "floating tree": (TREE, {"base": "floating"}),
    "with run-time parameters": (TREE, {"base": "floating", "parameters": "symbolic"}),
}


def compare(path: Path, options: dict[str, Any], folder: Path) -> None:
    system = read_system(path, Options(**options))
    write_package(generate(system, ["numpy"], "test"), folder / "test")
    dynamics = import_package(folder / "test").load("numpy")
    lock = dict(options.get("lock", {}))
    if "ab" in lock and "mimic" in path.read_text():
        lock["bc"] = 2.0 * lock["ab"] + 0.3
    oracle = PinocchioModel(path, system, options.get("base") == "floating", lock)
    states = random_states(dynamics.n, 20)
    each = list(zip(*states, strict=True))
    sums = np.stack([oracle.torque(*state) for state in each])
    assert relative_error(dynamics.inverse_dynamics(*states), sums) <= 1e-12
    shares = dynamics.partial_torque(*states)
    for j, name in enumerate(dynamics.link_names):
        own = np.stack([oracle.torque(*state, link=name) for state in each])
        assert relative_error(shares[:, :, j], own) <= 1e-12


@pytest.mark.parametrize("case", CASES)
def test_torques_are_pinocchios(case: str, tmp_path: Path) -> None:
    text, options = CASES[case]
    (tmp_path / "robot.urdf").write_text(text)
    compare(tmp_path / "robot.urdf", options, tmp_path)


def test_a_joint_follows_one_to_one_where_its_file_says_no_more(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(BARE)
    robot = read_robot(tmp_path / "robot.urdf")
    assert [(f.name, f.coordinate, f.curve.line) for f in robot.followers] == [("cd", "ab", (0.0, 1.0))]


PARTS = {
    "ball": ("RZ", "RY", "RX"),
    "floating": ("PX", "PY", "PZ", "RZ", "RY", "RX"),
    "planar": ("PX", "PY", "RZ"),
}


@pytest.mark.parametrize("kind", PARTS)
def test_joints_of_many_axes_are_pinocchios_composites(kind: str, tmp_path: Path) -> None:
    usual = {"axis": "0 0 1"} if kind == "planar" else {}
    (tmp_path / "robot.urdf").write_text(chain(AB, joint("bc", "b", "c", type=kind, **usual), CD))
    (tmp_path / "fixed.urdf").write_text(chain(AB, joint("bc", "b", "c", type="continuous", **usual), CD))
    plain = pin.buildModelFromUrdf(str(tmp_path / "fixed.urdf"))
    model = pin.Model()
    for number in range(1, plain.njoints):
        single = plain.joints[number]
        if plain.names[number] == "bc":
            single = pin.JointModelComposite()
            for part in PARTS[kind]:
                single.addJoint(getattr(pin, f"JointModel{part}")(), pin.SE3.Identity())
        model.addJoint(plain.parents[number], single, plain.jointPlacements[number], plain.names[number])
        model.appendBodyToJoint(number, plain.inertias[number], pin.SE3.Identity())
    write_package(generate(read_system(tmp_path / "robot.urdf"), ["numpy"], "test"), tmp_path / "test")
    dynamics = import_package(tmp_path / "test").load("numpy")
    assert dynamics.n == model.nv == model.nq
    states = random_states(dynamics.n, 20)
    data = model.createData()
    expected = np.stack([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])
    assert relative_error(dynamics.inverse_dynamics(*states), expected) <= 1e-12


def test_master_bears_the_torque_of_its_mimic(tmp_path: Path) -> None:
    """The master's τ is, with q_bc = a q_ab + b, τ_ab + a τ_bc of the robot that has both joints."""
    a, b = -1.7, 0.4
    texts = {"mimic": mimic("ab", a, b), "both": ""}
    robots = {}
    for name, inner in texts.items():
        (tmp_path / f"{name}.urdf").write_text(chain(AB, joint("bc", "b", "c", inner=inner)))
        write_package(generate(read_system(tmp_path / f"{name}.urdf"), ["numpy"], name), tmp_path / name)
        robots[name] = import_package(tmp_path / name).load("numpy")
    assert robots["mimic"].joint_names == ("ab",)
    q, qd, qdd = random_states(1, 10)
    both = (np.hstack([q, a * q + b]), np.hstack([qd, a * qd]), np.hstack([qdd, a * qdd]))
    expected = robots["both"].inverse_dynamics(*both) @ [[1.0], [a]]
    assert relative_error(robots["mimic"].inverse_dynamics(q, qd, qdd), expected) <= 1e-14


def test_tip_and_root_keep_what_they_say(tmp_path: Path) -> None:
    (tmp_path / "tree.urdf").write_text(TREE)
    names = {
        (None, None): "ab bc ad de df",
        (None, "c"): "ab bc",
        ("d", None): "de df",
        ("a", "e"): "ad de",
        ("d", "f"): "df",
    }
    for (root, tip), joints in names.items():
        system = read_system(tmp_path / "tree.urdf", Options(root=root, tip=tip))
        assert " ".join(c.name for c in system.coordinates) == joints
    cut = {n.subject for n in system.robot.notes if n.kind == "cut"}
    assert cut == set("abce")
    # What hangs on d is the robot whose file ends there.
    (tmp_path / "part.urdf").write_text(
        robot(*map(link, "def"), joint("de", "d", "e"), joint("df", "d", "f"))
    )
    whole, part = read_system(tmp_path / "tree.urdf", Options(root="d")), read_system(tmp_path / "part.urdf")
    assert whole.robot.links == part.robot.links


def test_notes_say_what_was_done(tmp_path: Path) -> None:
    losses = '<dynamics damping="0.5" friction="0"/>'
    text = robot(
        *map(link, "abc"),
        '<link name="d"><visual/></link>',
        joint("ab", "a", "b", rpy="1.5707963267948966 0 0", inner=losses),
        joint("bc", "b", "c", type="fixed"),
        joint("cd", "c", "d", type="continuous"),
        "<transmission/><transmission/>",
    )
    (tmp_path / "robot.urdf").write_text(text)
    notes = read_system(tmp_path / "robot.urdf", Options(lock={"cd": 0.2})).robot.notes
    found = {(note.kind, note.subject, note.detail) for note in notes}
    assert found == {
        ("snapped", "ab", "rotation entries within 1e-12 of -1, 0, 1"),
        ("ignored", "limit", "1 ×"),
        ("ignored", "transmission", "2 ×"),
        ("ignored", "visual", "1 ×"),
        ("locked", "cd", "at 0.2 rad"),
        ("merged", "a", "into the ground, with its 1.5 kg"),
        ("merged", "c", "into b"),
        ("merged", "d", "into b"),
        ("passive", "ab", "0.5 N·m·s/rad"),
    }


def test_turns_of_ninety_degrees_leave_nothing_behind(tmp_path: Path) -> None:
    right = joint(
        "ab", "a", "b", rpy="1.5707963267948966 -1.5707963267948966 3.141592653589793", axis="0 0 1"
    )
    (tmp_path / "robot.urdf").write_text(chain(right))
    rotation = read_system(tmp_path / "robot.urdf").robot.links[0].joint.rotation
    assert {entry for row in rotation for entry in row} <= {-1.0, 0.0, 1.0}


def test_extensions_of_simulators_that_load_joints_are_told(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(
        robot(
            *map(link, "abc"),
            joint("ab", "a", "b"),
            joint("bc", "b", "c", inner='<rotor_inertia value="0.01"/>'),
            '<gazebo reference="b"><turnGravityOff>true</turnGravityOff></gazebo>',
            '<gazebo reference="ab"><springStiffness>3</springStiffness><dampingFactor>0</dampingFactor>',
            '</gazebo><gazebo reference="bc"><springStiffness/></gazebo>',
            '<transmission><joint name="bc"/><actuator><motorInertia>0.2</motorInertia></actuator>',
            "</transmission>",
        )
    )
    told = {
        "Gazebo's switch for gravity left out of the torques: b",
        "spring apart from the links' torques, by passive_torque: ab (3 N·m/rad)",
        "armature left out of the torques: bc (0.01), bc (0.2)",
    }
    assert set(effects(read_system(tmp_path / "robot.urdf").robot.notes)) == told
    held = effects(read_system(tmp_path / "robot.urdf", Options(lock={"bc": 0.0})).robot.notes)
    assert set(held) == told - {"armature left out of the torques: bc (0.01), bc (0.2)"}
