"""MJCF through MuJoCo's compiler, against MuJoCo's own inverse dynamics."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states, relative_error
from linkwise import LinkwiseError, Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.robot import effects

mujoco = pytest.importorskip("mujoco")

MODEL = """<mujoco model="crane">
<compiler angle="radian"/><option gravity="1 -2 -9"><flag contact="disable" constraint="disable"/></option>
<worldbody><geom type="plane" size="1 1 1"/>
  <body name="mast" pos="0.1 0 0.5" euler="0 1.5707963267948966 0">
    <joint name="lift" type="slide" axis="1 0.5 0" ref="0.2" damping="{loss}"/>
    <joint name="swing" type="hinge" axis="0 1 1" pos="0.1 0.2 0.3" ref="-0.4"/>
    <geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0" euler="0.3 0.2 0.1" mass="3"/>
    <body pos="0 0 0.7" quat="0.9 0.1 0.3 0.2"><geom size="0.1" mass="0.5"/>
      <body name="hook" pos="0.2 0 0"><joint name="neck" type="{kind}" pos="0 0.1 0"/>
        <inertial pos="0.1 0 0.05" mass="1.5" fullinertia="0.02 0.03 0.04 0.001 0.002 -0.003"/>
        <body pos="0 0 0.4"><joint axis="1 0 0" frictionloss="{loss}"/><geom size="0.05" mass="0.2"/></body>
      </body>
    </body>
  </body>
  {more}
</worldbody>{actuator}</mujoco>"""
FREE = """<body name="drone" pos="1 2 3" euler="0.1 0.2 0.3"><freejoint name="fly"/>
  <geom type="box" size="0.1 0.2 0.05" pos="0.02 0 0.1" mass="0.8"/>
  <body name="rotor" pos="0.1 0 0"><joint name="spin" axis="0 0 1"/>
    <geom size="0.1" pos="0.1 0 0" mass="0.1"/></body>
</body>"""


def write(folder: Path, kind: str = "hinge", more: str = "", loss: float = 0.0, actuator: str = "") -> Path:
    path = folder / "crane.xml"
    path.write_text(MODEL.format(kind=kind, more=more, loss=loss, actuator=actuator))
    return path


def rates(angles: Any, turning: Any) -> tuple[Any, Any]:
    """E with ω = E (yaw, pitch, roll)' in the turned frame, R = Rz Ry Rx, and its time derivative."""
    (_, b, c), (_, db, dc) = angles, turning
    sb, cb, sc, cc = np.sin(b), np.cos(b), np.sin(c), np.cos(c)
    e = np.array([[-sb, 0, 1], [cb * sc, cc, 0], [cb * cc, -sc, 0]])
    de = np.array(
        [
            [-cb * db, 0, 0],
            [-sb * sc * db + cb * cc * dc, -sc * dc, 0],
            [-sb * cc * db - cb * sc * dc, -cc * dc, 0],
        ]
    )
    return e, de


def quaternion(angles: Any) -> Any:
    """Quaternion of Rz(yaw) Ry(pitch) Rx(roll)."""
    turn = np.array([1.0, 0, 0, 0])
    for angle, axis in zip(angles, np.eye(3)[::-1], strict=True):
        step, result = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)]), np.empty(4)
        mujoco.mju_mulQuat(result, turn, step)
        turn = result
    return turn


def mujocos_torque(path: Path, names: tuple[str, ...], q: Any, qd: Any, qdd: Any) -> Any:
    """Torques of MuJoCo's inverse dynamics in linkwise's coordinates, in the order of its dofs."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    jacobian = np.eye(len(names))
    bias = np.zeros(len(names))
    qpos: list[float] = []
    for k, name in enumerate(names):
        if name.endswith("_yaw"):
            turn = slice(k, k + 3)
            jacobian[turn, turn], derivative = rates(q[turn], qd[turn])
            bias[turn] = derivative @ qd[turn]
            qpos += [*quaternion(q[turn])]
        elif not name.endswith(("_pitch", "_roll")):
            qpos.append(q[k])
    data.qpos, data.qvel, data.qacc = qpos, jacobian @ qd, jacobian @ qdd + bias
    mujoco.mj_inverse(model, data)
    return jacobian.T @ data.qfrc_inverse


@pytest.mark.parametrize(("kind", "more"), [("hinge", ""), ("ball", ""), ("slide", FREE)])
def test_torques_sum_to_mujocos_inverse_dynamics(kind: str, more: str, tmp_path: Path) -> None:
    path = write(tmp_path, kind, more)
    write_package(generate(read_system(path), ["numpy"]), tmp_path / "crane")
    dynamics = import_package(tmp_path / "crane").load("numpy")
    states = random_states(dynamics.n, 50)
    expected = [mujocos_torque(path, dynamics.joint_names, *state) for state in zip(*states, strict=True)]
    assert relative_error(dynamics.inverse_dynamics(*states), expected) <= 1e-12


def test_what_is_not_used_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, loss=0.3, actuator='<actuator><motor joint="swing"/></actuator>')
    notes = read_system(path).robot.notes
    ignored = {note.subject: note.detail for note in notes if note.kind == "ignored"}
    assert ignored == {"actuator": "1 ×"}
    losses = {(note.kind, note.subject, note.detail) for note in notes if note.effect}
    assert losses == {("passive", "lift", "0.3 N·s/m")}
    assert ("snapped", "lift") in {(note.kind, note.subject) for note in notes}


def test_what_mujoco_refuses_is_told_in_its_words(tmp_path: Path) -> None:
    path = tmp_path / "bad.xml"
    path.write_text('<mujoco><worldbody><body><joint type="screw"/></body></worldbody></mujoco>')
    with pytest.raises(LinkwiseError, match=r"bad\.xml: MuJoCo cannot compile it: .*screw|invalid keyword"):
        read_system(path)


def test_without_mujoco_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(
        LinkwiseError, match=r"mujoco is needed for this and is missing: pip install 'linkwise\[mjcf\]'"
    ):
        read_system(write(tmp_path))


LEGS = """<mujoco model="legs">{option}<worldbody>
  <body name="hip"><joint name="h" axis="0 1 0"/><geom size="0.1" mass="2"/>
    <body name="left" pos="0 0.2 0"><joint name="l" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.3" mass="1"/>
      <site name="end" pos="0 0 -0.5"/></body>
    <body name="right" pos="0 -0.2 0"><joint name="r" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.3" mass="1"/>
      <site name="tip" pos="0 0 -0.5"/></body>
  </body></worldbody>
  <tendon><fixed name="cord"><joint joint="l" coef="1"/></fixed></tendon>
  <equality>{equality}</equality></mujoco>"""
CONNECT = '<connect {}body1="left" body2="right" anchor="0 0 -0.5"/>'


def legs(folder: Path, equality: str, option: str = "") -> Path:
    path = folder / "legs.xml"
    path.write_text(LEGS.format(equality=equality, option=option))
    return path


SPATIAL = (
    '<tendon><spatial name="rope"><site site="end"/><site site="tip"/></spatial></tendon>'
    '<equality><tendon name="taut" tendon1="rope"/></equality>'
)


@pytest.mark.parametrize(
    ("equality", "more", "named"),
    [
        ("", SPATIAL, "the tendon equality 'taut' ties links together by tendon 'rope'"),
        (
            '<tendon name="bent" tendon1="cord" tendon2="both" polycoef="0 1 2 0 0"/>',
            '<tendon><fixed name="both"><joint joint="l" coef="1"/><joint joint="r" coef="1"/></fixed>'
            "</tendon>",
            "the tendon equality 'bent' ties links together by tendon 'cord', 'both'",
        ),
    ],
    ids=["spatial tendon", "square of a sum"],
)
def test_equality_that_is_not_modelled_is_refused_by_name(
    equality: str, more: str, named: str, tmp_path: Path
) -> None:
    path = legs(tmp_path, equality)
    path.write_text(path.read_text().replace("</mujoco>", f"{more}</mujoco>"))
    with pytest.raises(LinkwiseError) as caught:
        read_system(path)
    assert f"legs.xml: {named}, which is not modelled: remove it from the file" in str(caught.value)
    assert len(read_system(path, Options(lock={"l": 0.3, "r": -0.3})).links) == 1


def robot_of(path: Path, options: Options | None = None) -> Any:
    return getattr(read_system(path, options), "robot")  # noqa: B009 - of rigid links it has one


@pytest.mark.parametrize(
    ("attributes", "option"),
    [
        ('active="false" ', ""),
        ("", '<option><flag equality="disable"/></option>'),
        ("", '<option><flag constraint="disable"/></option>'),
    ],
    ids=["inactive", "equalities off", "constraints off"],
)
def test_equality_that_is_switched_off_is_not_a_loop(attributes: str, option: str, tmp_path: Path) -> None:
    assert not robot_of(legs(tmp_path, CONNECT.format(attributes), option)).ties


def test_equality_has_a_name_and_both_of_its_ends(tmp_path: Path) -> None:
    [pin] = robot_of(legs(tmp_path, CONNECT.format('name="pin" '))).ties
    assert pin.name == "pin"
    robot = robot_of(legs(tmp_path, CONNECT.format("") + '<weld name="glue" body1="hip"/>'))
    assert [(tie.name, tie.kind) for tie in robot.ties] == [("connect1", "point"), ("glue", "frame")]
    ends = [[robot.frames[at].name for at in (tie.first, tie.second)] for tie in robot.ties]
    assert ends == [["end", "connect1_second"], ["hip", "world"]]
    assert not robot_of(legs(tmp_path, CONNECT.format("")), Options(lock={"l": 0.3, "r": 0.3})).ties
    with pytest.raises(
        LinkwiseError, match="'connect1' ties link 'left' to link 'right', which --root or --tip"
    ):
        read_system(legs(tmp_path, CONNECT.format("")), Options(tip="left"))


def test_tendon_without_a_force_of_its_own_is_not_told_as_left_out(tmp_path: Path) -> None:
    assert not effects(read_system(legs(tmp_path, "")).notes)


def test_free_body_tells_what_its_coordinates_mean_for_the_torques(tmp_path: Path) -> None:
    path = write(tmp_path, "ball", more=FREE)
    (free, ball) = sorted(effects(read_system(path).robot.notes), key=len, reverse=True)
    assert free == (
        "six coordinates without any contact forces, singular at a pitch of ±90°: "
        "fly (floating: x, y, z, yaw, pitch, roll)"
    )
    assert ball == "singular at a pitch of ±90°: neck (ball: yaw, pitch, roll)"
