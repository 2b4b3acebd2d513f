"""A robot's own file after an identification, of other kinds than URDF: other numbers, all else as it was."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.motion_logs import write_csv
from helpers.shown_model import ShownModel
from linkwise import generate, read_robot, read_system, write_package
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.uncertain_file import read_uncertain
from linkwise.cli.app import app
from typer.testing import CliRunner

from identification.test_identify import other_bodies, own_parameters, swings

mujoco = pytest.importorskip("mujoco", reason="needs mujoco: pip install 'linkwise[mjcf]'")

MJCF = """<mujoco model="arm">
  <!-- weighed in March -->
  <default><joint damping="0.1"/><default class="finger"><geom density="500"/></default></default>
  <worldbody>
    <frame pos="0 0 0.4">
      <body name="upper">
        <joint  name="shoulder" axis="0 1 0" range="-90 120" frictionloss='0.05'/>
        <inertial pos="0.01 0.02 0.15" mass="2.5" quat="0.9 0.1 -0.2 0.3" diaginertia="0.02 0.018 0.004"/>
        <body name="lower" pos="0 0 0.3" euler="6 0 0">
          <joint name="elbow" axis="0.6 0 0.8"/>
          <geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.2"/>
          <body name="hand" pos="0.02 0 0.25">
            <inertial pos="0 0.01 0.04" mass="0.6" fullinertia="0.0008 0.0011 0.0009 0.0001 0 0"/>
            <body pos="0 0 0.1" childclass="finger">
              <joint name="slide" type="slide" axis="1 0 0"/>
              <geom size="0.03" pos="0 0.01 0.02"/><site name="tip" pos="0 0 0.06"/>
            </body>
          </body>
        </body>
      </body>
    </frame>
  </worldbody>
</mujoco>
"""

SDF = """<?xml version="1.0"?>
<sdf version="1.9"><model name="arm">
  <link name="upper">
    <pose>0 0 0.4 0 0 0</pose> <!-- weighed in March -->
    <inertial>
      <pose degrees="true">0.01 0.02 0.15   17 -11 29</pose>
      <mass> 2.5 </mass>
      <inertia><ixx>0.02</ixx><iyy>0.018</iyy><izz>0.004</izz></inertia>
    </inertial>
  </link>
  <link name="lower"><pose>0 0 0.7 0.1 0 0</pose>
    <inertial><mass>1.5</mass><inertia>
        <ixx>0.008</ixx><ixy>0</ixy><ixz>0</ixz><iyy>0.009</iyy><iyz>0</iyz><izz>0.006</izz>
    </inertia></inertial></link>
  <link name="hand"><pose relative_to="lower">0.02 0 0.25 0 0.7 0</pose>
    <inertial><mass>0.6</mass><inertia><ixx>0.0008</ixx><iyy>0.0011</iyy><izz>0.0009</izz></inertia></inertial></link>
  <link name="finger"><pose relative_to="hand">0 0 0.1 0 0 0.3</pose>
    <inertial><pose/><mass>0.2</mass><inertia><ixx>2e-4</ixx><iyy>2e-4</iyy><izz>1e-4</izz></inertia></inertial></link>
  <joint name="shoulder" type="revolute"><parent>world</parent><child>upper</child>
    <axis><xyz>0 1 0</xyz><limit><lower>-1.5</lower><upper>2</upper></limit>
      <dynamics><damping>0.1</damping></dynamics></axis></joint>
  <joint name="elbow" type="revolute"><parent>upper</parent><child>lower</child>
    <axis><xyz>0.6 0 0.8</xyz></axis></joint>
  <joint name="wrist" type="fixed"><parent>lower</parent><child>hand</child></joint>
  <joint name="slide" type="prismatic"><parent>hand</parent><child>finger</child>
    <axis><xyz>1 0 0</xyz></axis></joint>
</model></sdf>
"""

TOML = """# weighed in March
schema = 1
name = "arm"

[parameters]
reach = 0.3

# ---- shoulder ----
[[joint]]
name = "shoulder"
parent = "base"
child = "upper"
xyz = [0, 0, 0.4]
axis = [0, 1, 0]
damping = 0.1  # of the bearing
lower = -1.5

[[link]]
name = "upper"
mass = 2.5  # kg
com = ["reach / 30", 0.02, 0.15]  # from a drawing
inertia = { xx = 0.02, yy = 0.018, zz = 0.004 }

# ---- elbow ----
[[joint]]
name = "elbow"
parent = "upper"
child = "lower"
xyz = [0, 0, "reach"]
rpy = [0.1, 0, 0]
axis = [0.6, 0, 0.8]

[[link]]
name = "lower"
mass = 1.5
[link.inertia]
xx = 0.008
yy = 0.009
zz = 0.006

# ---- wrist ----
[[joint]]
name = "wrist"
type = "fixed"
parent = "lower"
child = "hand"
xyz = [0.02, 0, 0.25]

[[link]]
name = "hand"
mass = 0.6
inertia.xx = 0.0008
inertia.yy = 0.0011
inertia.zz = 0.0009

# ---- slide ----
[[joint]]
name = "slide"
type = "prismatic"
parent = "hand"
child = "finger"
xyz = [0, 0, 0.1]
axis = [1, 0, 0]

[[link]]
name = "finger"
mass = 0.2
inertia = { xx = 2e-4, yy = 2e-4, zz = 1e-4 }
"""

OSIM = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><Model name="arm"><!-- weighed -- in March -->
  <gravity>0 -9.80665 0</gravity>
  <BodySet name="bodyset"><objects>
    <Body name="upper"><mass> 2.5 </mass><mass_center>0.01 0.02 0.15</mass_center>
      <inertia>0.02 0.018 0.004 0.001 0 0</inertia></Body>
    <Body name="lower"><mass>1.5</mass><mass_center>0 -0.1 0</mass_center>
      <inertia>0.008 0.006 0.009 0 0 0</inertia></Body>
    <Body name="hand"><mass>0.6</mass><inertia>0.0008 0.0011 0.0009 0 0 0</inertia></Body>
  </objects></BodySet>
  <JointSet name="jointset"><objects>
    <PinJoint name="s"><socket_parent_frame>/ground</socket_parent_frame>
      <socket_child_frame>/bodyset/upper</socket_child_frame>
      <coordinates><Coordinate name="shoulder"/></coordinates></PinJoint>
    <PinJoint name="e"><socket_parent_frame>on_upper</socket_parent_frame>
      <socket_child_frame>/bodyset/lower</socket_child_frame>
      <coordinates><Coordinate name="elbow"/></coordinates>
      <frames><PhysicalOffsetFrame name="on_upper"><socket_parent>/bodyset/upper</socket_parent>
        <translation>0.02 -0.3 0.1</translation><orientation>0.1 0.4 0</orientation>
      </PhysicalOffsetFrame></frames></PinJoint>
    <WeldJoint name="w"><socket_parent_frame>on_lower</socket_parent_frame>
      <socket_child_frame>/bodyset/hand</socket_child_frame>
      <frames><PhysicalOffsetFrame name="on_lower"><socket_parent>/bodyset/lower</socket_parent>
        <translation>0 -0.25 0</translation><orientation>0 0 0.7</orientation>
      </PhysicalOffsetFrame></frames></WeldJoint>
  </objects></JointSet>
</Model></OpenSimDocument>
"""
TEXTS = {"arm.xml": MJCF, "arm.sdf": SDF, "arm.toml": TOML, "arm.osim": OSIM}
RUBS = np.array([[0.4, 0.3], [0.25, 0.1], [1.5, 0.5]])


def identified(folder: Path, name: str, text: str, *more: str) -> tuple[np.ndarray, list[str]]:
    """Torques of twenty seconds by bodies other than the file's, (S, n), and what `identify` warned of."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(text.encode())
    arm = loaded(folder / name, folder / "before")
    t, q, qd, qdd = swings(len(arm.joints), 20, 100)
    torque = np.einsum("sijp,jp->si", arm.model.regressor(q, qd, qdd), other_bodies(own_parameters(arm)))
    rubs = RUBS[: len(arm.joints)] * ("--no-friction" not in more)
    measured = torque + rubs[:, 0] * qd + rubs[:, 1] * np.sign(qd)
    names = [*arm.joints, *(f"tau/{joint}" for joint in arm.joints)]
    log = write_csv(folder / "log.csv", np.column_stack([t, q, measured]), names)
    command = ["identify", str(log), "--robot", str(folder / name), "--out", str(folder / "out")]
    done = CliRunner().invoke(
        app, [*command, "--backend", "numpy", "--units", "rad", *more], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    return torque, json.loads((folder / "out/identified.json").read_text())["warnings"]


def by_mujoco(robot: Path, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Return what MuJoCo says of the same file, of its links alone."""
    model = mujoco.MjModel.from_xml_path(str(robot))
    model.dof_damping[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, answers = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, qd, qdd, strict=True):
        mujoco.mj_inverse(model, data)
        answers.append(data.qfrc_inverse.copy())
    return np.array(answers)


def by_opensim(robot: Path, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    osim = pytest.importorskip("opensim")
    osim.Logger.setLevelString("off")
    model, answers = osim.Model(str(robot)), []
    state = model.initSystem()
    for positions, speeds, accelerations in zip(q, qd, qdd, strict=True):
        state.setQ(osim.Vector(positions.tolist()))
        state.setU(osim.Vector(speeds.tolist()))
        torque = osim.InverseDynamicsSolver(model).solve(state, osim.Vector(accelerations.tolist()))
        answers.append([torque.get(i) for i in range(torque.size())])
    return np.array(answers)


def by_the_rules_of_sdformat(robot: Path, q: np.ndarray, *_: np.ndarray) -> np.ndarray:
    shown = ShownModel(robot.read_text())
    return np.array([shown.gravity_torque(positions) for positions in q])


ORACLES = {"arm.xml": by_mujoco, "arm.osim": by_opensim, "arm.sdf": by_the_rules_of_sdformat}


def loaded(robot: Path, folder: Path):
    write_package(generate(read_system(robot), ["numpy"]), folder)
    return load_robot(folder)


def without_numbers(text: str) -> str:
    """Return what is left of a file when the numbers that are identified, and elements of nothing else, are
    gone."""
    for gone in (
        r"<inertial [^>]*/>",
        r"(?s)(?<=<inertial>).*?(?=</inertial>)",
        r"<dynamics>.*?</dynamics>",
        r' (damping|frictionloss)=["\'][^"\']*["\'](?=[^<]*/>)',
        r"<(mass|mass_center|inertia)>[^<]*</\1>",
        r"(?m)^(mass|com|inertia\S*|xx|yy|zz|xy|xz|yz|damping|friction) =.*?(?=  #|$)",
    ):
        text = re.sub(gone, "", text)
    return re.sub(r"\s+", "", text)


@pytest.mark.parametrize("name", TEXTS)
def test_a_robots_own_file_has_the_identified_bodies_and_is_else_as_it_was(name: str, tmp_path: Path) -> None:
    choice = ["--no-friction"] if name == "arm.osim" else []
    torque, warnings = identified(tmp_path / "a", name, TEXTS[name].replace("\n", "\r\n"), *choice)
    after = (tmp_path / "a/out" / name).read_bytes().decode()
    assert sorted(path.name for path in (tmp_path / "a/out").iterdir()) == sorted(
        [name, "identified.json", "identified.md", "uncertain.toml"]
    )
    assert without_numbers(after) == without_numbers(TEXTS[name])
    assert after.count("\n") == after.count("\r\n") > 10
    arm = loaded(tmp_path / "a/out" / name, tmp_path / "after")
    # The covariance is in the terms of this robot: it has the parameters that the file beside it names.
    assert read_uncertain(tmp_path / "a/out/uncertain.toml", arm).links == arm.links
    _, q, qd, qdd = swings(len(arm.joints), 20, 100)
    bound = 2e-3 * abs(torque).max()
    np.testing.assert_allclose(arm.model.inverse_dynamics(q, qd, qdd), torque, atol=bound)
    if oracle := ORACLES.get(name):
        few = slice(None, None, 97)
        held = oracle(tmp_path / "a/out" / name, q[few], qd[few], qdd[few])
        if name == "arm.sdf":  # where it is at rest
            torque = arm.model.inverse_dynamics(q, 0.0 * q, 0.0 * q)
        np.testing.assert_allclose(held, torque[few], atol=bound)
    if name != "arm.osim":
        passive = {axis.joint: axis for axis in read_robot(tmp_path / "a/out" / name).passive}
        found = [(passive[joint].damping, passive[joint].friction) for joint in arm.joints]
        np.testing.assert_allclose(found, RUBS, atol=2e-2)
    assert bool(warnings) == (name == "arm.toml")
    if warnings:
        assert warnings == [
            "arm.toml had formulas in mass, com or inertia of upper, in whose place there are numbers"
        ]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("arm.toml", 'com = ["reach / 30", ', 'com = ["reach / 30",  # beside the axis\n  '),
        ("arm.sdf", "<mass>0.2</mass>", "<mass>0.2 <!-- beside the axis --></mass>"),
        ("arm.osim", "<mass>1.5</mass>", "<mass><!-- # beside the axis -->1.5</mass>"),
    ],
)
def test_comments_inside_of_numbers_stay(name: str, old: str, new: str, tmp_path: Path) -> None:
    identified(tmp_path / "a", name, TEXTS[name].replace(old, new))
    after = (tmp_path / "a/out" / name).read_text()
    assert "beside the axis" in after
    assert new not in after


def test_a_table_of_a_link_that_stands_among_others_is_not_written_back(tmp_path: Path) -> None:
    table, wrist = "[link.inertia]\nxx = 0.008\nyy = 0.009\nzz = 0.006\n", "xyz = [0.02, 0, 0.25]\n"
    text = TOML.replace(table, "").replace(wrist, wrist + table)
    _, warnings = identified(tmp_path / "a", "arm.toml", text)
    assert warnings[0] == (
        "arm.toml has a table of [[link]] behind other tables; move it to its link; arm.urdf is a new file"
    )


def test_friction_has_no_place_in_an_opensim_model(tmp_path: Path) -> None:
    _, warnings = identified(tmp_path / "a", "arm.osim", OSIM)
    assert warnings == [
        f"arm.osim has no place for the friction of {joint}, as no joint of OpenSim has any"
        for joint in ("shoulder", "elbow")
    ]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (
            "<default>",
            '<compiler settotalmass="9"/><default>',
            "has settings under which MuJoCo changes the mass",
        ),
        ("<default>", '<compiler inertiafromgeom="true"/><default>', "has settings under which MuJoCo"),
        ("<default>", '<option><flag frictionloss="disable"/></option><default>', "rubs otherwise"),
        (
            "</worldbody>",
            '<replicate count="2"><body><geom size="1"/></body></replicate></worldbody>',
            "repeats",
        ),
    ],
)
def test_where_mujoco_would_make_something_else_of_it_a_new_file_is_written_and_why_is_told(
    old: str, new: str, why: str, tmp_path: Path
) -> None:
    torque, warnings = identified(tmp_path / "a", "arm.xml", MJCF.replace(old, new))
    assert why in warnings[0]
    assert warnings[0].endswith("; arm.urdf is a new file")
    assert not (tmp_path / "a/out/arm.xml").exists()
    arm = loaded(tmp_path / "a/out/arm.urdf", tmp_path / "after")
    _, q, qd, qdd = swings(3, 20, 100)
    np.testing.assert_allclose(arm.model.inverse_dynamics(q, qd, qdd), torque, atol=2e-3 * abs(torque).max())


def test_of_a_file_that_mujoco_reads_although_it_is_no_xml_a_new_one_is_written(tmp_path: Path) -> None:
    _, warnings = identified(tmp_path / "a", "arm.mjcf", MJCF.replace("weighed", "weighed -- well"))
    assert warnings[0].startswith("arm.mjcf is not quite XML (")
    assert (tmp_path / "a/out/arm.urdf").exists()


def test_files_that_mujoco_includes_are_found_and_told(tmp_path: Path) -> None:
    (tmp_path / "a/parts").mkdir(parents=True)
    defaults, text = MJCF[MJCF.index("  <default>") : MJCF.index("  <worldbody>")], MJCF
    (tmp_path / "a/parts/defaults.xml").write_text(f"<mujoco>{defaults}</mujoco>")
    text = text.replace(defaults, '<include file="parts/defaults.xml"/>')
    _, warnings = identified(tmp_path / "a", "arm.xml", text)
    assert warnings == [
        "arm.xml reads other files, by paths from its own folder: put it there, under another name, for "
        "MuJoCo to find them"
    ]
    assert '<include file="parts/defaults.xml"/>' in (tmp_path / "a/out/arm.xml").read_text()
