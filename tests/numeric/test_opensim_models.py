"""Models of OpenSim as they are read, beside OpenSim itself: each kind of joint, coupling and function."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.osim_text import (
    KNEE,
    LINEAR,
    LINES,
    ROLLING,
    ROLLS,
    Custom,
    Kind,
    chain,
    coefficients,
    constraints,
    coupler,
    multiplied,
    points,
)
from linkwise import generate, read_robot, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)

import opensim

from numeric.opensim_beside import Beside, bare
from numeric.opensim_model import numbers

LIMIT = 1e-12
ROUNDED = 1e-4
"""OpenSim keeps six digits of the frames of a format 3 file."""
CHAINS: dict[str, Sequence[Kind]] = {
    "pin, slider": ["PinJoint", "SliderJoint"],
    "universal, gimbal": ["UniversalJoint", "GimbalJoint"],
    "weld between planar and pin": ["PlanarJoint", "WeldJoint", "PinJoint"],
    "ball, pin": ["BallJoint", "PinJoint"],
    "free, ball": ["FreeJoint", "BallJoint"],
    "knee between pins": ["PinJoint", KNEE, "PinJoint"],
    "rolling, knee": [ROLLING, KNEE],
}
SETS = {
    "coupled": constraints(coupler("joint3_angle", "joint0_angle", LINES)),
    "coupled by turns": constraints(
        coupler("joint3_angle", "joint1_angle", coefficients("LinearFunction", -0.4, 0.1)),
        coupler(
            "joint1_angle", "joint0_angle", points("SimmSpline", (-1, 0.3), (0, 0.1), (0.7, 0.5), (1, 0))
        ),
    ),
    "not enforced": constraints(coupler("joint3_angle", "joint0_angle", LINES, enforced="false")),
}


def beside(folder: Path, text: str) -> Beside:
    (folder / "model.osim").write_text(text)
    return Beside(folder / "model.osim", folder / "package")


@pytest.mark.parametrize("kinds", CHAINS.values(), ids=CHAINS)
def test_generalized_forces_and_each_bodys_share_are_opensims(kinds: Sequence[Kind], tmp_path: Path) -> None:
    assert max(beside(tmp_path, chain(kinds)).errors()) <= LIMIT


def test_a_joint_may_lead_towards_ground(tmp_path: Path) -> None:
    kinds = [KNEE, "UniversalJoint", "SliderJoint"]
    assert max(beside(tmp_path, chain(kinds, turned=(0, 1))).errors()) <= LIMIT


def test_where_opensims_velocity_terms_are_off_its_energies_are_not(tmp_path: Path) -> None:
    """Simbody's are where the second and the third rotation follow one coordinate, as in Rajagopal's knee."""
    axes = {f"rotation{k + 1}": (axis, "angle", ROLLS) for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"))}
    both = beside(tmp_path, chain(["PinJoint", Custom(("angle",), axes), "PinJoint"]))
    assert max(both.errors()) > 1e-6
    assert both.error_of_energies() <= 1e-8


@pytest.mark.parametrize("sets", SETS.values(), ids=SETS)
def test_coupled_coordinates_load_the_one_that_they_follow(sets: str, tmp_path: Path) -> None:
    both = beside(tmp_path, chain(["PinJoint", KNEE, "SliderJoint", "PinJoint"], sets))
    assert max(both.errors()) <= LIMIT


def test_a_locked_coordinate_and_limits(tmp_path: Path) -> None:
    more = {
        "joint0_first": "<default_value>0.4</default_value><locked>true</locked>",
        "joint1_angle": "<range>-0.2 0.1</range><clamped>true</clamped>",
    }
    both = beside(tmp_path, chain(["UniversalJoint", KNEE], coordinates=more))
    assert list(both.names) == ["joint0_second", "joint1_angle"]
    assert -0.2 <= both.motion[0, 1] <= 0.1
    assert max(both.errors()) <= LIMIT


ENDS = (("body2", "0.1 -0.2 0.3", "0.4 -0.7 1.1"), ("ground", "0.5 0.6 -0.4", "-0.3 0.5 0.2"))
"""Body, place and turn of each end of a constraint."""


def held_by(kind: str, old: bool, more: str) -> str:
    """A constraint with its ends on bodies, or in offset frames of theirs, as a WeldConstraint has them."""
    ends = frames = ""
    for n, (body, place, turn) in enumerate(ENDS, 1):
        path = f"/{body}" if body == "ground" else f"/bodyset/{body}"
        if kind == "WeldConstraint" and not old:
            ends += f"<socket_frame{n}>end{n}</socket_frame{n}>"
            frames += (
                f'<PhysicalOffsetFrame name="end{n}"><socket_parent>{path}</socket_parent>'
                f"<translation>{place}</translation><orientation>{turn}</orientation></PhysicalOffsetFrame>"
            )
            continue
        ends += f"<body_{n}>{body}</body_{n}>" if old else f"<socket_body_{n}>{path}</socket_body_{n}>"
        ends += f"<location_body_{n}>{place}</location_body_{n}>"
        ends += f"<orientation_body_{n}>{turn}</orientation_body_{n}>" if kind == "WeldConstraint" else ""
    return constraints(f'<{kind} name="tie">{ends}<frames>{frames}</frames>{more}</{kind}>')


@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize(
    ("kind", "more"),
    [
        ("PointConstraint", ""),
        ("WeldConstraint", ""),
        ("ConstantDistanceConstraint", "<constant_distance>0.7</constant_distance>"),
    ],
)
def test_constraints_close_where_opensims_do(kind: str, more: str, old: bool, tmp_path: Path) -> None:
    file = tmp_path / "model.osim"
    file.write_text(chain(["FreeJoint", "PinJoint", "GimbalJoint"], held_by(kind, old, more), old=old))
    write_package(generate(read_system(file), ["numpy"], kernel="loops"), tmp_path / "package")
    robot: Any = import_package(tmp_path / "package").load("numpy")
    model = opensim.Model(str(file))
    state = model.initSystem()
    beside = robot.constraints.closed_position + np.random.default_rng(1).uniform(-0.05, 0.05, (3, robot.n))
    for q in robot.constraints.closed(beside):
        for name, value in zip(robot.joint_names, q, strict=True):
            model.getCoordinateSet().get(name).setValue(state, float(value), False)
        model.realizePosition(state)
        assert np.abs(numbers(state.getQErr())).max() <= (ROUNDED if old else LIMIT)


def test_a_coupling_is_scaled_as_opensim_scales_it(tmp_path: Path) -> None:
    coupled = coupler("joint1_angle", "joint0_angle", ROLLS).replace(
        "</coupled_coordinates_function>", "</coupled_coordinates_function><scale_factor>-1.7</scale_factor>"
    )
    file = tmp_path / "model.osim"
    file.write_text(chain(["PinJoint", "PinJoint"], constraints(coupled)))
    (follower,) = read_robot(file).followers
    model = opensim.Model(str(file))
    state = model.initSystem()
    for at in (-1.3, 0.2, 0.9):
        for name, value in (("joint0_angle", at), (follower.name, follower.curve(at))):
            model.getCoordinateSet().get(name).setValue(state, value, False)
        model.realizePosition(state)
        assert np.abs(numbers(state.getQErr())).max() <= LIMIT


TURNS = {
    "a line": coefficients("LinearFunction", 1.0, 0.3),
    "there and back": coefficients("LinearFunction", -1.0, 0.0),
    "half as far": coefficients("LinearFunction", 0.5, 0.0),
    "a polynomial": coefficients("PolynomialFunction", 1.0, 0.0),
    "a product": multiplied(1.0, LINEAR),
}


@pytest.mark.parametrize("slides", [False, True])
@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_which_coordinates_files_have_in_degrees_is_opensims_choice(
    turn: str, slides: bool, tmp_path: Path
) -> None:
    axes = {"rotation1": ("1 0 0", "angle", turn)}
    axes |= {"translation1": ("1 0 0", "angle", LINEAR)} if slides else {}
    file = tmp_path / "model.osim"
    file.write_text(chain([Custom(("angle",), axes), "PinJoint"]))
    model = opensim.Model(str(file))
    model.initSystem()
    kind = model.getCoordinateSet().get(0).getMotionType()
    coordinate = read_robot(file).coordinates[0]
    assert kind in (1, 2, 3), "rotational, translational or coupled"
    assert (coordinate.unit, coordinate.coupled) == ("m" if kind == 2 else "rad", kind == 3)


@pytest.mark.parametrize("kinds", [["PinJoint", KNEE, "PinJoint"], ["UniversalJoint", ROLLING, KNEE]])
def test_what_joints_bear_is_what_opensim_calls_their_reactions(
    kinds: Sequence[Kind], tmp_path: Path
) -> None:
    both = beside(tmp_path, chain(kinds))
    model, locked = bare(both.file, ())
    state, (q, qd, _) = model.initSystem(), both.motion
    moved = both._moved(model, state, locked, q, qd, 0.0 * qd)
    model.realizeAcceleration(state)  # nothing but gravity drives it
    rates = numbers(state.getUDot()) - moved.turning @ moved.rate - moved.turn @ moved.jerk
    qdd = np.linalg.lstsq(moved.turn @ moved.columns, rates, rcond=None)[0]
    links = {
        both.robot.backend.tree.joints[link.joint].link: link.joint for link in both.robot.backend.tree.links
    }
    for k in range(model.getJointSet().getSize()):
        joint = model.getJointSet().get(k)
        child = joint.getChildFrame()
        at, force = child.getPositionInGround(state), joint.calcReactionOnChildExpressedInGround(state)
        expected = np.array([[part.get(row) for row in range(3)] for part in (force.get(0), force.get(1))])
        given = {"axes": "world", "point": [at.get(row) for row in range(3)]}
        own = links[child.findBaseFrame().getName()]
        found = both.robot.reactions(q, qd, qdd, joints=own, **given).total[0]
        assert np.abs(found - expected.ravel()).max() <= LIMIT * np.abs(expected).max()
