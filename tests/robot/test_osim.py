"""OpenSim's files as they are read: formats, names and units, what is left out, and what is refused."""

import re
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from helpers.osim_text import (
    KNEE,
    LINES,
    ROLLING,
    SLIDES,
    Custom,
    chain,
    coefficients,
    constant,
    constraints,
    coupler,
    model,
    points,
)
from linkwise import LinkwiseError, Options, generate, read_robot, read_system, write_package
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.load import import_package
from linkwise.robot.notes import effects
from linkwise.robot.robot import Limits

KINDS = ["FreeJoint", KNEE, "UniversalJoint", ROLLING, "WeldJoint", "PinJoint"]
KNEE_FILE = Path(__file__).parents[1] / "data" / "knee.osim"


def robot_of(folder: Path, text: str):  # type: ignore[no-untyped-def]
    (folder / "model.osim").write_text(text)
    return read_robot(folder / "model.osim")


def forces(content: str) -> str:
    return f"<ForceSet><objects>{content}</objects></ForceSet>"


def test_both_formats_say_the_same(tmp_path: Path) -> None:
    new, old = (robot_of(tmp_path, chain(KINDS, old=old, turned=(1, 3))) for old in (False, True))
    assert new == old
    assert new.name == "chain"


def test_what_opensim_reads_though_it_is_no_xml_is_read(tmp_path: Path) -> None:
    plain = chain(["PinJoint"])
    force = '<HuntCrossleyForce name="heel"><HuntCrossleyForce::ContactParametersSet/></HuntCrossleyForce>'
    odd = chain(["PinJoint"], "<!-- two -- hyphens -->" + forces(force))
    assert robot_of(tmp_path, odd).links == robot_of(tmp_path, plain).links
    (tmp_path / "model.osim").write_bytes(plain.replace("body0", "fémur").encode("latin-1"))
    assert [link.name for link in read_robot(tmp_path / "model.osim").links] == ["fémur"]


def test_comments_that_do_not_end_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "bad.osim"
    path.write_text('<OpenSimDocument Version="40000">' + "<!--" * 20_000)
    with pytest.raises(LinkwiseError, match=r"bad.osim: malformed XML: no element found"):
        in_own_process(lambda: read_system(path), ProcessLimits(seconds=2, memory=1 << 28))


def test_frames_are_found_by_their_whole_paths(tmp_path: Path) -> None:
    plain = chain(["PinJoint", "PinJoint"])
    expected = robot_of(tmp_path, plain).links
    own = plain.replace('name="parent0"', 'name="start"').replace(">parent0<", ">start<")
    for text in (
        own.replace('name="parent1"', 'name="start"').replace(">parent1<", ">start<"),
        own.replace('name="child0"', 'name="body0"').replace(">child0<", ">/jointset/joint0/body0<"),
        plain.replace("<socket_parent>/bodyset/body0<", "<socket_parent>../../../bodyset/body0<"),
    ):
        assert text != plain
        assert robot_of(tmp_path, text).links == expected


def test_components_may_stand_among_those_of_others(tmp_path: Path) -> None:
    kinds = ["PinJoint", "PinJoint"]
    coupled = coupler("joint1_angle", "joint0_angle", LINES)
    spread = chain(kinds, f"<components>{coupled}</components>")
    assert robot_of(tmp_path, spread) == robot_of(tmp_path, chain(kinds, constraints(coupled)))
    joints = chain(kinds).replace("<JointSet><objects>", "<components>")
    joints = joints.replace("</objects></JointSet>", "</components>")
    assert robot_of(tmp_path, joints) == robot_of(tmp_path, chain(kinds))


def test_a_body_without_mass_has_no_inertia(tmp_path: Path) -> None:
    text = chain(["PinJoint", "PinJoint"])
    light = re.sub(r'(name="body0"><mass>)[^<]*', r"\g<1>0", text)
    robot = robot_of(tmp_path, light)
    assert robot.links[0].inertia == ((0.0,) * 3,) * 3
    (note,) = (note for note in robot.notes if note.kind == "ignored")
    assert (note.subject, note.detail) == ("body0", "its inertia, as its mass is 0")


def test_coordinates_have_their_names_units_and_limits(tmp_path: Path) -> None:
    clamped = {
        "joint1_angle": "<range>-2 0.1</range><clamped>true</clamped>",
        "joint3_slip": "<range>0 1</range>",
    }
    robot = robot_of(tmp_path, chain(KINDS, coordinates=clamped))
    assert [(c.name.removeprefix("joint"), c.unit) for c in robot.coordinates] == [
        *((f"0_{name}", "rad") for name in ("first", "second", "third")),
        *((f"0_{name}", "m") for name in "xyz"),
        ("1_angle", "rad"),
        *((f"2_{name}", "rad") for name in ("first", "second")),
        ("3_turn", "rad"),
        ("3_slip", "m"),
        ("5_angle", "rad"),
    ]
    limits = dict(zip([c.name for c in robot.coordinates], robot.limits, strict=True))
    assert limits["joint1_angle"] == Limits(-2.0, 0.1)
    assert limits["joint3_slip"] == Limits()


def test_a_locked_coordinate_stays_where_the_file_says(tmp_path: Path) -> None:
    fixed = Custom(
        (), {"rotation1": ("1 0 0", "", constant(0.4)), "translation1": ("0 1 0", "", constant(0.2))}
    )
    held = Custom(
        ("turn", "slide"),
        {
            "rotation1": ("1 0 0", "turn", coefficients("LinearFunction", 1.0, 0.0)),
            "translation1": ("0 1 0", "slide", coefficients("LinearFunction", 1.0, 0.0)),
        },
    )
    locked = {"joint1_turn": 0.4, "joint1_slide": 0.2}
    more = {k: f"<default_value>{v}</default_value><locked>true</locked>" for k, v in locked.items()}
    ends = ["PinJoint", "PinJoint"]
    expected = robot_of(tmp_path, chain([ends[0], fixed, ends[1]]))
    robot = robot_of(tmp_path, chain([ends[0], held, ends[1]], coordinates=more))
    assert robot.links == expected.links
    assert {note.subject for note in robot.notes if note.kind == "locked"} == set(locked)


def test_what_gives_torques_is_ignored_and_what_acts_by_itself_is_left_out(tmp_path: Path) -> None:
    acting = forces(
        '<Thelen2003Muscle name="biceps"/><CoordinateActuator name="motor"/>'
        '<BushingForce name="disc"/><CoordinateLimitForce name="stop"><coordinate>joint0_angle</coordinate>'
        '</CoordinateLimitForce><Ligament name="band"><appliesForce>false</appliesForce></Ligament>'
        '<Unheard name="of"/>'
    )
    notes = robot_of(tmp_path, chain(["PinJoint"], acting)).notes
    assert {note.subject for note in notes if note.kind == "ignored"} == {
        "Thelen2003Muscle",
        "CoordinateActuator",
        "band",  # which the model does not apply
    }
    left = {note.subject: (note.detail, note.effect) for note in notes if note.kind == "left out"}
    assert left == {
        "disc": ("", "bushing left out of the torques"),
        "stop": ("on joint0_angle", "spring at the ends of its range left out of the torques"),
        "of": ("", "Unheard left out of the torques"),
    }


def test_a_coordinate_that_files_in_degrees_have_in_radians_is_told(tmp_path: Path) -> None:
    (note,) = effects(robot_of(tmp_path, chain([ROLLING, KNEE])).notes)
    assert note.startswith("in radians in every log")
    assert note.endswith(": joint0_turn")


def test_constraints_between_bodies_close_loops(tmp_path: Path) -> None:
    pin = constraints(
        '<PointConstraint name="pin"><socket_body_1>/bodyset/body1</socket_body_1>'
        "<socket_body_2>/ground</socket_body_2><location_body_1>0.1 0 0</location_body_1>"
        "<location_body_2>0 0.2 0</location_body_2></PointConstraint>"
    )
    bars = ["PlanarJoint", "PlanarJoint"]
    closed = robot_of(tmp_path, chain(bars, pin))
    (tie,) = closed.ties
    assert (tie.name, tie.kind) == ("pin", "point")
    assert closed.frames[tie.second].translation == (0.0, 0.2, 0.0), "on the ground"
    for switch in ("<isEnforced>false</isEnforced>", "<isDisabled>true</isDisabled>"):
        off = pin.replace("</PointConstraint>", f"{switch}</PointConstraint>")
        assert robot_of(tmp_path, chain(bars, off)).ties == ()


def test_a_coupled_coordinate_follows_and_no_other(tmp_path: Path) -> None:
    coupled = constraints(coupler("joint1_angle", "joint0_angle", LINES))
    robot = robot_of(tmp_path, chain(["PinJoint", "PinJoint"], coupled))
    assert [coordinate.name for coordinate in robot.coordinates] == ["joint0_angle"]
    assert [follower.name for follower in robot.followers] == ["joint1_angle"]


def test_a_function_may_stand_without_a_name(tmp_path: Path) -> None:
    wrapped = robot_of(tmp_path, chain([KNEE]))
    bare = robot_of(tmp_path, chain([KNEE]).replace(' name="function"', ""))
    assert bare == wrapped


def fault(**changes: object) -> str:
    return chain(["PinJoint", "PinJoint"], **changes)  # type: ignore[arg-type]


def bent(function: str) -> Custom:
    return Custom(("angle",), {"rotation1": ("1 0 0", "angle", function)})


WRONG: Mapping[str, tuple[str, str]] = {
    "another root": ("<Model/>", "the root element is <Model>; an OpenSim model has"),
    "no bodies": (model(""), "the model 'chain' has no <Body>; give one that has some"),
    "centimetres": (model("<length_units>cm</length_units>"), "lengths are in cm; give them in meters"),
    "joint type": (
        fault().replace("PinJoint", "EllipsoidJoint"),
        "joint 'joint0' is of type EllipsoidJoint, which is not modelled; make it one of CustomJoint",
    ),
    "function": (
        chain([bent("<Sine></Sine>")]),
        "joint 'joint0', rotation1 is a Sine, a function that is not modelled",
    ),
    "points": (
        chain([bent(points("SimmSpline", (0, 1), (0, 2)))]),
        "joint 'joint0', rotation1: its <SimmSpline> needs as many <y> as <x>, two or more, and <x> that",
    ),
    "coordinate": (
        chain([KNEE]).replace("<coordinates>joint0_angle", "<coordinates>knee"),
        "names 'knee', which is not a coordinate of the joint; it has joint0_angle",
    ),
    "axis of no direction": (
        chain([KNEE]).replace("<axis>0 0 1</axis>", "<axis>0 0 0</axis>", 1),
        "joint 'joint0', rotation1 has a zero axis; give its direction",
    ),
    "two coordinates": (
        chain([ROLLING]).replace("<coordinates>joint0_turn<", "<coordinates>joint0_turn joint0_slip<"),
        "rotation1 is a function of 2 coordinates; only functions of one are modelled",
    ),
    "number": (fault().replace("<mass>", "<mass>heavy "), "<mass>heavy"),
    "frame": (
        fault().replace("<socket_child_frame>child1<", "<socket_child_frame>nowhere<"),
        "PinJoint 'joint1' stands in the frame 'nowhere', of which there are 0; name a body, ground or",
    ),
    "no joint": (
        fault().replace("<socket_parent>/bodyset/body1<", "<socket_parent>/ground<"),
        "body 'body1' hangs on no joint; give it one, a FreeJoint to ground say",
    ),
    "no way from ground": (
        fault().replace("<socket_parent>/ground<", "<socket_parent>/bodyset/body1<"),
        "no joints lead from ground to 'body1', on which joint 'joint0' stands; give it one",
    ),
    "coupled in a circle": (
        fault(
            sets=constraints(
                coupler("joint1_angle", "joint0_angle", SLIDES),
                coupler("joint0_angle", "joint1_angle", LINES),
            )
        ),
        "leads back to itself; let one go free",
    ),
    "coupled to nobody": (
        fault(sets=constraints(coupler("joint1_angle", "hip", SLIDES))),
        "constraint 'joint1_angle_follows' names 'hip', which is not a coordinate; correct it",
    ),
    "constraint": (
        fault(sets=constraints('<RollingOnSurfaceConstraint name="wheel"/>')),
        "the model has the RollingOnSurfaceConstraint 'wheel'",
    ),
    "coordinate of no axis": (
        chain([ROLLING, "PinJoint"], constraints(coupler("joint1_angle", "joint0_slip", SLIDES))).replace(
            "<coordinates>joint0_slip<", "<coordinates>joint0_turn<"
        ),
        "coordinate 'joint0_slip' moves no axis of its joint 'joint0'; lock it",
    ),
    "line without a direction": (
        fault(
            sets=constraints(
                '<PointOnLineConstraint name="rail"><line_body>ground</line_body><follower_body>body1'
                "</follower_body></PointOnLineConstraint>"
            )
        ),
        "constraint 'rail': its <line_direction_vec> has no direction; give one",
    ),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_what_is_not_modelled_is_refused_by_its_place(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError) as refused:
        robot_of(tmp_path, text)
    assert message in str(refused.value)
    assert str(refused.value).startswith(str(tmp_path / "model.osim"))


def test_versions_are_read_as_the_page_says(tmp_path: Path) -> None:
    page = " ".join((Path(__file__).parents[2] / "docs/robots.md").read_text(encoding="utf-8").split())
    (bounds,) = re.findall(r"Its `Version` is (\d+) to (\d+), or from (\d+) on", page)
    first, last, later = map(int, bounds)
    old, new = chain([KNEE], old=True), chain([KNEE])
    for version in (first, last):
        assert robot_of(tmp_path, old.replace("30000", str(version))) == robot_of(tmp_path, old)
    assert robot_of(tmp_path, new.replace("40500", str(later))) == robot_of(tmp_path, new)


@pytest.mark.parametrize(
    ("version", "told"),
    [("10905", "Version '10905'"), ("30512", "Version '30512'"), ("4" * 5000, "'444444444444…")],
)
def test_versions_that_are_not_read_ask_for_opensim(
    version: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "opensim", None)
    with pytest.raises(LinkwiseError) as refused:
        robot_of(tmp_path, chain([KNEE]).replace("40500", version))
    assert told in str(refused.value)
    assert "pip install 'linkwise[opensim]'" in str(refused.value)


def test_a_coordinate_that_moves_nothing_is_held(tmp_path: Path) -> None:
    text = chain([ROLLING], coordinates={"joint0_slip": "<default_value>0.3</default_value>"})
    robot = robot_of(tmp_path, text.replace("<coordinates>joint0_slip<", "<coordinates>joint0_turn<"))
    assert [c.name for c in robot.coordinates] == ["joint0_turn"]
    (note,) = (note for note in robot.notes if note.kind == "locked")
    assert (note.subject, note.detail) == ("joint0_slip", "at 0.3, as it moves no axis")


def test_lengths_without_a_unit_are_metres(tmp_path: Path) -> None:
    text = chain(["PinJoint"], "<length_units>Unassigned</length_units>")
    robot = robot_of(tmp_path, text)
    assert robot.links == robot_of(tmp_path, chain(["PinJoint"])).links
    assert robot_of(tmp_path, text).notes[0].effect.startswith("lengths in metres")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            Options(tip="patella"),
            "'patella_slide' follows 'knee_angle', which --root or --tip cuts away",
        ),
        (Options(base="floating"), "'ground' is the world, which cannot float"),
        (Options(lock={"knee_t1": 0.0}), "'knee_t1' is not a moving joint; the joints are knee_angle"),
    ],
    ids=["cut", "floating", "locked"],
)
def test_what_would_be_another_model_is_refused(options: Options, message: str) -> None:
    with pytest.raises(LinkwiseError, match=message):
        read_robot(KNEE_FILE, options)


def test_a_joint_that_is_held_leaves_what_follows_where_it_is_there(tmp_path: Path) -> None:
    def mass_matrix(name: str, q: list[float], **lock: float) -> np.ndarray:
        files = generate(read_system(KNEE_FILE, Options(lock=lock)), ["numpy"])
        write_package(files, tmp_path / name)
        matrix: np.ndarray = import_package(tmp_path / name).load("numpy").mass_matrix(np.array(q))
        return matrix

    free, rest = mass_matrix("free", [0.1, -0.4, 0.7, 0.3, -0.2]), [0, 1, 2, 4]
    held = mass_matrix("held", [0.1, -0.4, 0.7, -0.2], knee_angle=0.3)
    np.testing.assert_allclose(held, free[np.ix_(rest, rest)], rtol=1e-13)


def test_closed_forms_of_curves_are_refused() -> None:
    system = read_system(KNEE_FILE)
    for asked in ({"kernel": "straight"}, {"derivation": "energy"}):
        with pytest.raises(LinkwiseError, match="joint 'knee_t1' follows a curve, and no closed forms"):
            generate(system, **asked)  # type: ignore[arg-type]


def test_what_is_true_may_be_written_as_1(tmp_path: Path) -> None:
    kinds, more = ["PinJoint", "PinJoint"], "<locked>{}</locked><default_value>0.4</default_value>"
    texts = ("true", "1", "True")
    held = [robot_of(tmp_path, chain(kinds, coordinates={"joint1_angle": more.format(t)})) for t in texts]
    assert all(robot == held[0] and len(robot.coordinates) == 1 for robot in held)
    coupled = [constraints(coupler("joint1_angle", "joint0_angle", LINES, enforced)) for enforced in "10"]
    assert [len(robot_of(tmp_path, chain(kinds, sets)).coordinates) for sets in coupled] == [1, 2]
    with pytest.raises(LinkwiseError, match="Coordinate 'joint1_angle': <locked>yes</locked> needs true or"):
        robot_of(tmp_path, chain(kinds, coordinates={"joint1_angle": more.format("yes")}))
