"""Odd models that OpenSim takes, beside OpenSim itself."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.osim_text import chain, constraints, model
from linkwise import LinkwiseError, generate, read_robot, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)

import opensim

from numeric.opensim_beside import Beside
from numeric.opensim_model import LoadedModel, numbers

LIMIT = 1e-12
LINK = "<mass_center>0.5 0.1 0.2</mass_center>"


def body(name: str, mass: float, content: str = "", inertia: str = "0.1 0.2 0.25 0.01 0.02 0.03") -> str:
    text = f"<mass>{mass}</mass>{LINK}<inertia>{inertia}</inertia>{content}"
    return f'<Body name="{name}">{text}</Body>'


def pin(name: str, parent: str, place: str, child: str, own: str = "0 0 0") -> str:
    """A hinge between places of a parent and of a child, which are paths."""
    frames = "".join(
        f'<PhysicalOffsetFrame name="{end}_{name}"><socket_parent>{carrier}</socket_parent>'
        f"<translation>{at}</translation></PhysicalOffsetFrame>"
        for end, carrier, at in (("p", parent, place), ("c", child, own))
    )
    return (
        f'<PinJoint name="{name}"><socket_parent_frame>p_{name}</socket_parent_frame><socket_child_frame>'
        f'c_{name}</socket_child_frame><coordinates><Coordinate name="{name}_angle"/></coordinates>'
        f"<frames>{frames}</frames></PinJoint>"
    )


def of(bodies: str, joints: str, sets: str = "") -> str:
    return model(
        f"<BodySet><objects>{bodies}</objects></BodySet><JointSet><objects>{joints}</objects></JointSet>{sets}"
    )


def written(folder: Path, text: str) -> Path:
    (folder / "model.osim").write_text(text)
    return folder / "model.osim"


def generated(file: Path) -> Any:
    write_package(generate(read_system(file), ["numpy"], kernel="loops"), file.parent / "package")
    return import_package(file.parent / "package").load("numpy")


TREE = (
    pin("j0", "/ground", "0 0 0", "/bodyset/b0"),
    pin("j1", "/bodyset/b0", "1 0 0", "/bodyset/b1"),
    pin("j2", "/bodyset/b1", "1.5 0 0", "/bodyset/b2", "0.2 0 0"),
)
BACK = ("loop", "/ground", "1.2 0 0")
"""Name of the joint that closes a loop, and where it stands."""


def test_a_body_with_two_joints_is_parted_as_one_that_is_parted_by_hand(tmp_path: Path) -> None:
    """OpenSim 4.6 gives the first part another inertia than half the body's, the others the right one."""
    others = body("b0", 1.0) + body("b1", 2.0)
    loop = generated(
        written(tmp_path, of(others + body("b2", 3.0), "".join(TREE) + pin(*BACK, "/bodyset/b2", "1.3 0 0")))
    )
    half = {"inertia": "0.05 0.1 0.125 0.005 0.01 0.015"}
    parts = body("b2", 1.5, **half) + body("b3", 1.5, **half)
    (tmp_path / "by_hand").mkdir()
    weld = constraints(
        '<WeldConstraint name="weld"><socket_frame1>/bodyset/b2</socket_frame1>'
        "<socket_frame2>/bodyset/b3</socket_frame2></WeldConstraint>"
    )
    by_hand = of(others + parts, "".join(TREE) + pin(*BACK, "/bodyset/b3", "1.3 0 0"), weld)
    both = Beside(written(tmp_path / "by_hand", by_hand), tmp_path / "by_hand" / "package")
    assert tuple(loop.joint_names) == tuple(both.names)
    expected = both.torques()
    assert np.abs(loop.inverse_dynamics(*both.motion) - expected).max() <= LIMIT * np.abs(expected).max()
    (q,) = loop.constraints.closed(loop.constraints.closed_position[None])
    opened = opensim.Model(str(tmp_path / "model.osim"))
    state = opened.initSystem()
    for name, value in zip(loop.joint_names, q, strict=True):
        opened.getCoordinateSet().get(name).setValue(state, float(value), False)
    opened.realizePosition(state)
    assert np.abs(numbers(state.getQErr())).max() <= 1e-9, "it closes where OpenSim's does"


def test_torques_of_a_point_on_a_line_move_opensims_model_as_it_moved(tmp_path: Path) -> None:
    line = constraints(
        '<PointOnLineConstraint name="rail"><socket_line_body>/bodyset/b0</socket_line_body>'
        "<socket_follower_body>/bodyset/b2</socket_follower_body><line_direction_vec>1 0.5 0"
        "</line_direction_vec><point_on_line>0.2 0.1 0</point_on_line><point_on_follower>0.4 0 0"
        "</point_on_follower></PointOnLineConstraint>"
    )
    file = written(tmp_path, of("".join(body(f"b{k}", 1.0 + k) for k in range(3)), "".join(TREE), line))
    robot = generated(file)
    assert robot.joint_names[-1] == "rail_slide"
    draw = np.random.default_rng(3)
    (q,) = robot.constraints.closed(robot.constraints.closed_position + draw.uniform(-0.05, 0.05, (1, 4)))
    own = [robot.joint_names.index(name) for name in robot.constraints.independent]
    yd, ydd = draw.uniform(-1.0, 1.0, (2, len(own)))
    ways = np.asarray(robot.constraints.velocity_map(q[None]))[0]
    qd = ways @ yd
    step = 1e-5
    near = [np.asarray(robot.constraints.velocity_map((q + way * step * qd)[None]))[0] for way in (1, -1)]
    qdd = ways @ ydd + (near[0] - near[1]) / (2.0 * step) @ yd
    torque = np.zeros(robot.n)
    torque[own] = ways.T @ robot.inverse_dynamics(q, qd, qdd)
    assert torque[-1] == 0.0, "what slides is nobody's joint"
    names = robot.joint_names[:-1]
    moved = LoadedModel(file, names)
    moved.motors(torque[:-1])
    state = moved.state(q[:-1], qd[:-1])
    assert np.abs(numbers(state.getQErr())).max() <= 1e-9
    moved.model.realizeAcceleration(state)
    found = numbers(state.getUDot())[moved.order(state)]
    assert np.abs(found - qdd[:-1]).max() <= 1e-6 * np.abs(qdd).max()


def on_stations(folder: Path, axes: tuple[str, str] = ("", ""), origin: str = "b0") -> Path:
    """A model of two bodies, the second on a frame by stations of the first; origin: the last one's body."""
    places = {"a": "0 0 0.1", "b": "1 0.2 0", "c": "0.1 1 0.3", "origin": "0.5 0.5 0.5"}
    carriers = dict.fromkeys(places, "b0") | {"origin": origin}
    stations = "".join(
        f'<Station name="{name}"><socket_parent_frame>/bodyset/{carriers[name]}</socket_parent_frame>'
        f"<location>{place}</location></Station>"
        for name, place in places.items()
    )
    sockets = "".join(
        f"<socket_{socket}>/bodyset/b0/{name}</socket_{socket}>"
        for name, socket in zip(places, ("point_a", "point_b", "point_c", "origin_point"), strict=True)
    )
    given = "".join(
        f"<{tag}>{a}</{tag}>" for tag, a in zip(("ab_axis", "ab_x_ac_axis"), axes, strict=True) if a
    )
    frame = f'<StationDefinedFrame name="by_stations">{sockets}{given}</StationDefinedFrame>'
    bodies = body("b0", 1.0, f"<components>{stations}{frame}</components>") + body("b1", 2.0)
    joints = TREE[0] + pin("j1", "/bodyset/b0/by_stations", "1 0 0", "/bodyset/b1", "0 0.1 0")
    return written(folder, of(bodies, joints))


@pytest.mark.parametrize("axes", [("", ""), ("-y", "+x"), ("z", "-y"), ("+x", "-z")])
def test_a_frame_by_stations_stands_where_opensims_does(axes: tuple[str, str], tmp_path: Path) -> None:
    both = Beside(on_stations(tmp_path, axes), tmp_path / "package")
    assert max(both.errors()) <= LIMIT


def test_a_frame_by_stations_of_several_bodies_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match="frame 'by_stations': its stations are on several bodies; give"):
        read_robot(on_stations(tmp_path, origin="b1"))


@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize(
    ("was", "now"),
    [
        ('name="joint1"', 'name="joint0"'),
        ('name="joint[12]"', 'name=""'),
        ('name="joint1_angle"', 'name=""'),
        ('name="body1"', 'name="body0"'),
    ],
)
def test_names_that_are_empty_or_anothers_become_opensims(
    was: str, now: str, old: bool, tmp_path: Path
) -> None:
    text = re.sub(was, now, chain(["PinJoint"] * 3, old=old))
    if "body" in was:  # joints then lead to the first of the two
        text = text.replace(">/bodyset/body1<", ">/bodyset/body0_0<").replace(">body1<", ">body0_0<")
    robot = read_robot(written(tmp_path, text))
    beside = opensim.Model(str(tmp_path / "model.osim"))
    beside.finalizeFromProperties()
    for own, theirs in (
        ([frame.name for frame in robot.frames if frame.name != "ground"], beside.getBodySet()),
        ([c.name for c in robot.coordinates], beside.getCoordinateSet() if "body" not in was else None),
    ):
        if theirs is not None:
            assert own == [theirs.get(k).getName() for k in range(theirs.getSize())]
    assert any("named so here" in note.effect for note in robot.notes)


def test_a_preview_of_opensim_4_is_read_as_opensim_converts_it(tmp_path: Path) -> None:
    text = chain(["PlanarJoint", "PinJoint"]).replace("40500", "30512")
    both = Beside(written(tmp_path, text), tmp_path / "package")
    assert max(both.errors()) <= LIMIT
    assert any("brought to OpenSim's latest" in note.effect for note in read_robot(both.file).notes)
    assert [file.name for file in tmp_path.iterdir() if file.suffix == ".log"] == []


def test_impossible_inertias_and_joints_without_inertia_are_opensims(tmp_path: Path) -> None:
    bodies = body("b0", 1.0, inertia="0.1 0.1 0.5 0 0 0") + '<Body name="b1"><mass>0</mass></Body>'
    bodies += body("b2", 2.0, inertia="0.3 0.1 0.1 0 0 0")
    joints = (*TREE[:2], pin("j2", "/bodyset/b1", "0 0 0", "/bodyset/b2"))
    both = Beside(written(tmp_path, of(bodies, "".join(joints))), tmp_path / "package")
    notes = read_robot(both.file).notes
    assert {note.subject for note in notes if note.kind == "unphysical"} == {
        "b0",
        "b2",
        "'j1_angle', 'j2_angle'",
    }
    assert max(both.errors()) <= LIMIT


def test_what_no_body_has_is_refused(tmp_path: Path) -> None:
    """OpenSim refuses the first and the last too; moments below 0 it computes with."""
    end = '<Body name="b2"><mass>0</mass></Body>'
    for bodies, told in (
        (body("b0", 1.0) + body("b1", 2.0) + end, "joint 'j2_angle' moves no mass at all"),
        ("".join(body(f"b{k}", 1.0, inertia="-0.1 0.1 0.1 0 0 0") for k in range(3)), "not positive"),
        ("".join(body(f"b{k}", -1.0) for k in range(3)), "negative mass"),
    ):
        with pytest.raises(LinkwiseError, match=told):
            read_robot(written(tmp_path, of(bodies, "".join(TREE))))
