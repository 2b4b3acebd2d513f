"""OpenSim's ExternalLoads: forces of a storage file on bodies, as the file of XML says."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from helpers.motion_logs import LEG, smooth, write_csv, write_mot
from linkwise import Contact, Load, generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.loads import Loads
from linkwise.errors import LinkwiseError

NAMES = [f"{side}ground_force_{what}" for side in ("", "1_") for what in ("vx", "vy", "vz", "px", "py", "pz")]
NAMES += [f"{side}ground_torque_{axis}" for side in ("", "1_") for axis in "xyz"]
FORCE = """<ExternalForce name="{name}">{switch}<applied_to_body>{body}</applied_to_body>
<force_expressed_in_body>{axes}</force_expressed_in_body>
<point_expressed_in_body>{point_in}</point_expressed_in_body>
<force_identifier>{side}ground_force_v</force_identifier>
<point_identifier>{side}ground_force_p</point_identifier>
<torque_identifier>{side}ground_torque_</torque_identifier>
<data_source_name>Unassigned</data_source_name></ExternalForce>"""
USUAL = {"switch": "", "axes": "ground", "point_in": "ground", "side": ""}
RIGHT = {"name": "right", "body": "foot"}


def write_loads(folder: Path, *forces: dict[str, str], data: str = "grf.mot") -> Path:
    objects = "".join(FORCE.format(**(USUAL | force)) for force in forces)
    path = folder / "grf.xml"
    path.write_text(
        f"""<?xml version="1.0"?><OpenSimDocument Version="30000"><ExternalLoads name="walk"><objects>
        {objects}</objects><groups/><datafile>{data}</datafile></ExternalLoads></OpenSimDocument>"""
    )
    return path


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("walk")
    write_package(generate(read_system(LEG), ["numpy"]), folder / "leg")
    joints = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
    write_csv(folder / "walk.csv", smooth(80, 6), joints)
    time = np.arange(481) / 600
    table = np.column_stack([time, 50 * np.sin((2 + np.arange(18)) * time[:, None] + np.arange(18))])
    write_mot(folder / "grf.mot", np.round(table, 6), NAMES)
    return folder


def test_forces_are_on_the_bodies_and_in_the_axes_that_the_file_says(leg: Path) -> None:
    shank = {"name": "left", "body": "/bodyset/shank", "axes": "shank", "point_in": "thigh", "side": "1_"}
    off = {"name": "off", "body": "foot", "switch": "<isDisabled>true</isDisabled>"}
    gone = {"name": "gone", "body": "foot", "switch": "<appliesForce>false</appliesForce>"}
    path = write_loads(leg, RIGHT, shank, off, gone)
    result = analyze(leg / "walk.csv", leg / "leg", loads=[path])
    table = np.loadtxt(leg / "grf.mot", skiprows=10)
    time, numbers = table[:, 0], np.split(table[:, 1:], 6, axis=1)
    right, left = (
        {"force": numbers[at], "point": numbers[at + 1], "moment": numbers[4 + at // 2], "time": time}
        for at in (0, 2)
    )
    given = [
        Load("right", "foot", **right, point_in="ground"),
        Load("left", "shank", **left, axes="shank", point_in="thigh"),
    ]
    expected = analyze(leg / "walk.csv", leg / "leg", loads=given)
    assert [borne.record() for borne in result.loads] == [
        {"name": "right", "body": "foot", "file": "grf.mot", "cutoff": None},
        {"name": "left", "body": "shank", "file": "grf.mot", "cutoff": None},
    ]
    np.testing.assert_allclose(result.load_torque, expected.load_torque, rtol=0, atol=1e-10)
    assert np.abs(result["tau_load/knee_angle_r/right"]).max() > 1
    assert "tau_load/ankle_angle_r/left" not in {column.name for column in result.columns}


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (
            {"body": "calcn_r"},
            r"grf.xml: load 'right' on 'calcn_r': leg has no such body; its bodies are carriage, .*foot",
        ),
        ({"body": "base"}, r"grf.xml: load 'right' on 'base': that stands on the ground"),
        ({"side": "2_"}, r"force_identifier is '2_ground_force_v', and 0 columns of grf.mot begin so"),
        ({"axes": "tibia"}, r"load 'right', given in the axes of 'tibia': leg has no such body"),
        ({"switch": "<isDisabled>true</isDisabled>"}, r"grf.xml: no ExternalForce that is on"),
        ({"switch": "<isDisabled>maybe</isDisabled>"}, r"'right': <isDisabled>maybe<.* needs true or false"),
        ({"body": ""}, r"grf.xml: load 'right' has no applied_to_body; name the body there"),
    ],
)
def test_what_a_file_of_external_loads_lacks_is_named(leg: Path, force: dict[str, str], message: str) -> None:
    with pytest.raises(LinkwiseError, match=message):
        analyze(leg / "walk.csv", leg / "leg", loads=[write_loads(leg, RIGHT | force)])


@pytest.mark.parametrize(
    ("said", "misspelt"),
    [
        ("<point_identifier>", "<pont_identifier>"),
        ("<torque_identifier>", "<torqe_identifier>"),
        ("<force_expressed_in_body>", "<force_expresed_in_body>"),
        ("<isDisabled>", "<isDisabld>"),
        ("<ExternalForce name", "<ExternalForc name"),
        ("<datafile>", "<datafil>"),
    ],
)
def test_a_misspelt_name_moves_or_drops_no_force_unsaid(leg: Path, said: str, misspelt: str) -> None:
    path = write_loads(leg, RIGHT, RIGHT | {"name": "left", "switch": "<isDisabled>true</isDisabled>"})
    tag, wrong = (text.strip("<>").partition(" ")[0] for text in (said, misspelt))
    text = path.read_text().replace(said, misspelt, 1).replace(f"</{tag}>", f"</{wrong}>", 1)
    path.write_text(text)
    with pytest.raises(LinkwiseError, match=f"grf.xml: .* has <{wrong}>, .*; did you mean <{tag}>"):
        analyze(leg / "walk.csv", leg / "leg", loads=[path])


def test_what_a_file_of_external_loads_says_for_nobody_is_told(leg: Path) -> None:
    path = write_loads(leg, RIGHT)
    path.write_text(path.read_text().replace("<groups/>", "<plates>2</plates>"))
    result = analyze(leg / "walk.csv", leg / "leg", loads=[path])
    assert result.load_warnings == (
        "grf.xml: ignored, as OpenSim's ExternalLoads has no such name there: "
        "plates (1 × in ExternalLoads 'walk')",
    )


def test_a_force_without_a_point_is_told_to_act_at_the_bodys_origin(leg: Path) -> None:
    path = forces_alone(leg, "push_v", ["push_vx", "push_vy", "push_vz"])
    assert analyze(leg / "walk.csv", leg / "leg", loads=[path]).load_warnings == (
        "grf.xml: load 'right' has no point_identifier, so its force acts at the origin of foot",
    )


def test_a_missing_file_of_forces_is_named(leg: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"grf.xml: .*other.mot: no such file"):
        analyze(leg / "walk.csv", leg / "leg", loads=[write_loads(leg, RIGHT, data="other.mot")])
    with pytest.raises(LinkwiseError, match=r"none.xml: no such file"):
        analyze(leg / "walk.csv", leg / "leg", loads=[leg / "none.xml"])
    with pytest.raises(LinkwiseError, match=r"grf.xml: no datafile; name the .mot or .sto file"):
        analyze(leg / "walk.csv", leg / "leg", loads=[write_loads(leg, RIGHT, data="")])


def test_what_stands_among_defaults_is_no_load(leg: Path) -> None:
    path = write_loads(leg, RIGHT)
    expected = analyze(leg / "walk.csv", leg / "leg", loads=[path])
    shank = FORCE.format(**(USUAL | {"name": "default", "body": "shank", "side": "1_"}))
    text = path.read_text().replace("<objects>", f"<defaults>{shank}</defaults><objects>")
    path.write_text(text)
    np.testing.assert_array_equal(
        analyze(leg / "walk.csv", leg / "leg", loads=[path]).values, expected.values
    )


def forces_alone(folder: Path, identifier: str, names: Sequence[str]) -> Path:
    """A file of loads whose one force on the foot is at its origin, and its data, smooth(481, …)."""
    write_mot(folder / "plate.mot", smooth(481, len(names), rate=600), names)
    path = write_loads(folder, RIGHT, data="plate.mot")
    text = path.read_text().replace("ground_force_v", identifier)
    for other in ("point", "torque"):
        start, end = f"<{other}_identifier>", f"</{other}_identifier>"
        text = text[: text.index(start)] + text[text.index(end) + len(end) :]
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["push_v_z", "push_v_y", "push_v_x"], "stand as .*; bring them into the order x, y, z"),
        (["push_vz", "push_vy", "push_vx"], "stand as .*; bring them into the order x, y, z"),
        (["push_vx", "push_vx", "push_vy"], "plate.mot: columns 2 and 3 are both named 'push_vx'; rename"),
        (["push_vx", "push_vx2", "push_vy"], "stand as .*; name one of them x, one y and one z"),
        (["push_v", "push_vy", "push_vz"], "stand as .*; name one of them x, one y and one z"),
        (["push_vx", "push_vy"], "and 2 columns of plate.mot begin so; it needs three"),
    ],
)
def test_forces_that_are_not_one_of_x_y_and_z_each_are_refused(
    leg: Path, names: list[str], message: str
) -> None:
    with pytest.raises(LinkwiseError, match=message):
        analyze(leg / "walk.csv", leg / "leg", loads=[forces_alone(leg, "push_v", names)])


@pytest.mark.parametrize(
    "names",
    [
        ["push_vx", "push_vy", "push_vz"],
        ["push_v_1", "push_v_2", "push_v_3"],
        ["push_vX_left", "push_vY_left", "push_vZ_left"],
        ["push_v_of_wall", "push_vx", "push_vy", "push_vz"],
    ],
)
def test_forces_ask_of_joints_what_the_jacobian_says(leg: Path, names: list[str]) -> None:
    """The joints are two slides, along x and y, and four that turn about z: -Jᵀ f of the foot's origin."""
    result = analyze(leg / "walk.csv", leg / "leg", loads=[forces_alone(leg, "push_v", names)])
    table = smooth(481, len(names), rate=600)[:, [0, -3, -2, -1]]
    x, y, _ = (np.interp(result.time, table[:, 0], column) for column in table[:, 1:].T)
    turns = np.cumsum(result.q[:, 2:5], axis=1)
    lengths = np.array([0.07, 0.429, 0.43])  # pelvis to hip, to knee, to ankle
    places = np.zeros((2, len(x), 4))
    places[..., 1:] = np.cumsum(lengths * np.stack([np.sin(turns), -np.cos(turns)]), axis=-1)
    arm_x, arm_y = places[..., -1:] - places
    turning = arm_x * y[:, None] - arm_y * x[:, None]
    expected = -np.column_stack([x, y, turning])
    np.testing.assert_allclose(result.load_torque.sum(-1), expected, rtol=0, atol=1e-6)


def test_forces_that_are_switched_off_are_told(leg: Path) -> None:
    off = {"name": "off", "body": "foot", "switch": "<isDisabled>true</isDisabled>"}
    gone = {"name": "", "body": "shank", "switch": "<appliesForce>false</appliesForce>"}
    result = analyze(leg / "walk.csv", leg / "leg", loads=[write_loads(leg, off, RIGHT, gone)])
    assert result.load_warnings == tuple(
        f"grf.xml: force {name!r} is switched off there, and left out" for name in ("off", "shank")
    )


def test_columns_that_two_loads_are_from_are_told(leg: Path) -> None:
    path = write_loads(leg, RIGHT, {"name": "left", "body": "shank"})
    result = analyze(leg / "walk.csv", leg / "leg", loads=[path])
    assert result.load_warnings == tuple(
        f"grf.mot: the {part} of load 'left' is from the columns of 'right': is one body's given for two?"
        for part in ("force", "moment")
    )


def test_what_is_noticed_in_files_of_contacts_loads_is_told_too(leg: Path) -> None:
    off = {"name": "off", "body": "foot", "switch": "<isDisabled>true</isDisabled>"}
    contacts = Contacts((Contact("foot"),), loads=(write_loads(leg, RIGHT, off),))
    result = analyze(leg / "walk.csv", leg / "leg", contacts=contacts)
    assert result.load_warnings == ("grf.xml: force 'off' is switched off there, and left out",)


def test_a_file_of_loads_that_is_given_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "plates.xml"
    with pytest.raises(LinkwiseError, match=r"plates.xml is given 2 times, as loads; give it once"):
        Loads.of([path, tmp_path / "beside" / ".." / "plates.xml"])
