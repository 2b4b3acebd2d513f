"""Setups of OpenSim's induced acceleration analysis: what they ask for, and what is refused in one line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.induced_setup import BODIES, COORDINATES, read_storage, write_case
from linkwise import LinkwiseError
from linkwise.analysis.opensim.setup import read_setup

ROLLS = (
    '<RollingOnSurfaceConstraint name="sole"><socket_rolling_body>/bodyset/body3</socket_rolling_body>'
    "<socket_surface_body>/ground</socket_surface_body></RollingOnSurfaceConstraint>"
)
POINT = (
    '<PointConstraint name="toe"><body_1>ground</body_1><body_2>body3</body_2>'
    "<location_body_2>0.1 0 -0.2</location_body_2></PointConstraint>"
)
WELD = (
    '<WeldConstraint name="heel"><socket_frame1>/ground</socket_frame1><socket_frame2>here</socket_frame2>'
    '<frames><PhysicalOffsetFrame name="here"><socket_parent>/bodyset/body3</socket_parent>'
    "<translation>0 0.5 0</translation></PhysicalOffsetFrame></frames></WeldConstraint>"
)


def test_a_setup_is_a_command_line(tmp_path: Path) -> None:
    asked = read_setup(write_case(tmp_path, ROLLS, "plate.xml", "body1 CENTER_OF_MASS"))
    assert (asked.log, asked.robot) == (tmp_path / "walk.sto", tmp_path / "leg.osim")
    points = asked.options.pop("induced")
    assert points[::2] == ["joints", "centre-of-mass"]
    assert points[1].startswith("body1,"), "at its centre of mass"
    assert asked.options == {
        "ignore_extra": True,
        "induced_whole": True,
        "sto": "walk_InducedAccelerations",
        "sto_units": "rad",
        "from_time": 0.2,
        "to_time": 1.2,
        "cutoff": 6.0,
        "filter_order": 3,
        "contact": ["sole:body3=pressed"],
        "contact_loads": (str(tmp_path / "plate.xml"),),
        "contact_threshold": 20.0,
    }
    assert asked.told == (
        "RollingOnSurfaceConstraint: what it holds doesn't slip, whatever its friction_coefficient",
    )


@pytest.mark.parametrize(
    ("constraints", "loads", "wanted"),
    [
        (WELD, "plate.xml", ["heel:body3=held@0.0,0.5,0.0"]),
        (POINT, "plate.xml", ["toe:body3=pressed-point@0.1,0.0,-0.2"]),
        (POINT, "", ["toe:body3=point@0.1,0.0,-0.2"]),
        (WELD + POINT, "", ["heel:body3=held@0.0,0.5,0.0", "toe:body3=point@0.1,0.0,-0.2"]),
        (WELD.replace("<frames>", "<isEnforced>false</isEnforced><frames>"), "", None),
        ("", "", None),
    ],
)
def test_constraints_of_a_setup_are_contacts(
    constraints: str, loads: str, wanted: list[str] | None, tmp_path: Path
) -> None:
    options = read_setup(write_case(tmp_path, constraints, loads)).options
    assert options.get("contact") == wanted
    assert ("contact_loads" in options) == bool(loads)


def test_external_loads_without_constraints_are_sources(tmp_path: Path) -> None:
    asked = read_setup(write_case(tmp_path, "", "plate.xml"))
    assert asked.options["loads"] == (str(tmp_path / "plate.xml"),)
    assert "are sources of their own" in asked.told[0]


def changed(path: Path, old: str, new: str) -> Path:
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<step_interval>1", "<step_interval>10", "step_interval 10: every sample is written"),
        (
            "<report_constraint_reactions>false",
            "<report_constraint_reactions>true",
            "no such file is written",
        ),
        ("<states_file/>", "<speeds_file>v.sto</speeds_file>", "velocities are those of the coordinates"),
        (
            "</AnalyzeTool>",
            "<plot>x</plot></AnalyzeTool>",
            "ignored, as AnalyzeTool has no such name there: plot",
        ),
        (
            "<groups/></AnalysisSet>",
            "<groups/></AnalysisSet><ControllerSet><objects><X/></objects></ControllerSet>",
            "torques are those of the motion",
        ),
        (
            "</InducedAccelerations>",
            "</InducedAccelerations><Kinematics name='k'/>",
            "Kinematics 'k' is left out",
        ),
    ],
)
def test_what_a_setup_asks_beyond_is_told(old: str, new: str, told: str, tmp_path: Path) -> None:
    asked = read_setup(changed(write_case(tmp_path), old, new))
    assert any(told in line for line in asked.told)


def test_states_come_before_coordinates_and_are_not_filtered(tmp_path: Path) -> None:
    setup = changed(write_case(tmp_path), "<states_file/>", "<states_file>leg.osim</states_file>")
    asked = read_setup(setup)
    assert asked.log == tmp_path / "leg.osim"
    assert "cutoff" not in asked.options
    assert asked.told == ("coordinates_file: the motion is that of states_file, which is not filtered",)


def test_muscles_are_no_sources(tmp_path: Path) -> None:
    setup = changed(write_case(tmp_path), "<states_file/>", "<force_set_files>forces.xml</force_set_files>")
    forces = '<Thelen2003Muscle name="soleus"/><CoordinateActuator name="a"/><BushingForce name="disc"/>'
    text = "<OpenSimDocument><ForceSet><objects>{}</objects></ForceSet></OpenSimDocument>"
    (tmp_path / "forces.xml").write_text(text.format(forces))
    assert read_setup(setup).told == (
        "sources are the torques of coordinates, in place of 2 muscles and actuators",
        "force_set_files: BushingForce 'disc' is left out",
    )


def test_times_without_bounds_and_no_filter_ask_for_all_of_the_log(tmp_path: Path) -> None:
    setup = write_case(tmp_path)
    for old, new in (("0.2</ini", "-Inf</ini"), ("1.2</fin", "Inf</fin"), (">6</low", ">-1</low")):
        changed(setup, old, new)
    assert not {"from_time", "to_time", "cutoff", "filter_order"} & read_setup(setup).options.keys()
    changed(setup, "<end_time>Inf", "<end_time>0.7")
    assert read_setup(setup).options["to_time"] == 0.7


REFUSED = {
    "words": (r"(?s).*", "not XML", r"malformed XML: syntax error"),
    "entity": (r"^<Open", '<!DOCTYPE x [<!ENTITY e "e">]><Open', r"malformed XML: it defines entities"),
    "tool": ("AnalyzeTool", "ForwardTool", r"there is <ForwardTool>, and no <AnalyzeTool>"),
    "no analysis": ("InducedAccelerations", "Kinematics", r"has <Kinematics>, 0 <InducedAccelerations>"),
    "off": ("<on>true", "<on>false", r"0 <InducedAccelerations> that are on; one is carried out"),
    "neither": ("<on>true", "<on>maybe", r"<on>maybe</on> needs true or false"),
    "no model": ("leg.osim", "", r"<AnalyzeTool> has no model_file; name the .osim file there"),
    "model": ("leg.osim", "arm.osim", r"model_file \S*arm.osim: no such file"),
    "no motion": ("walk.sto", "Unassigned", r"neither coordinates_file nor states_file"),
    "motion": ("walk.sto", "run.sto", r"coordinates_file \S*run.sto: no such file"),
    "folder": ("walk.sto", ".", r"coordinates_file \S*: this is a directory"),
    "loads": ("plate.xml", "plates.xml", r"external_loads_file \S*plates.xml: no such file"),
    "coordinate": (
        "<coordinate_names>All",
        "<coordinate_names>joint1_angel",
        r"no 'joint1_angel'; it has 'joint1_angle'",
    ),
    "body": ("center_of_mass", "centre_of_mass", r"body_names: the model has no 'centre_of_mass'; it has"),
    "nothing": ("<coordinate_names>All", "<coordinate_names>", r"coordinate_names and body_names are empty"),
    "time": (
        "0.2</initial_time>",
        "soon</initial_time>",
        r"<initial_time>soon</initial_time> needs a number",
    ),
    "misspelt": (
        "force_threshold>",
        "force_treshold>",
        r"has <force_treshold>, .*did you mean <force_threshold>\?",
    ),
    "potentials": ("only>false", "only>true", r"compute_potentials_only asks what muscles could do"),
    "kind": (
        "RollingOnSurfaceConstraint",
        "CoordinateCouplerConstraint",
        r"CoordinateCouplerConstraint 'sole' takes the place of no external force",
    ),
    "frame": (
        "/bodyset/body3",
        "/bodyset/body9",
        r"stands in the frame '/bodyset/body9', of which there are 0",
    ),
    "bodies": ("/ground", "/bodyset/body2", r"'sole' is between body3 and body2; one is ground"),
    "slope": (
        "</RollingOn",
        "<surface_normal>1 1 0</surface_normal></RollingOn",
        r"surface_normal 1 1 0 is not against gravity",
    ),
    "actuators": ("<states_file/>", "<force_set_files>a.xml</force_set_files>", r"a.xml: no such file"),
}
"""Text of a setup, the text in its place, and the message."""


EVERYWHERE = ("tool", "no analysis", "misspelt", "kind")


@pytest.mark.parametrize("name", REFUSED)
def test_a_broken_setup_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    old, new, message = REFUSED[name]
    bodies = "" if name == "nothing" else "All"
    setup = write_case(tmp_path, ROLLS, "plate.xml", bodies)
    text = re.sub(old, new, setup.read_text(), count=0 if name in EVERYWHERE else 1)
    setup.write_text(text.replace(" center_of_mass", "") if name == "nothing" else text)
    with pytest.raises(LinkwiseError, match=message) as refused:
        read_setup(setup)
    assert str(refused.value).startswith(str(setup))
    assert "\n" not in str(refused.value)


def test_a_setup_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"gone\.xml: no such file$"):
        read_setup(tmp_path / "gone.xml")


def test_a_pressed_foot_needs_loads(tmp_path: Path) -> None:
    with pytest.raises(
        LinkwiseError, match="'sole' needs an external_loads_file, which says where it presses"
    ):
        read_setup(write_case(tmp_path, ROLLS))


def analyze(folder: Path, *more: str, code: int = 0) -> str:
    done = run_linkwise("analyze", *more, "--out", "out", "--no-page", folder=folder)
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def test_a_setup_and_its_command_line_write_the_same(tmp_path: Path) -> None:
    setup = write_case(tmp_path, ROLLS, "plate.xml", "center_of_mass")
    changed(setup, "<in_degrees>false", "<in_degrees>true")
    analyze(tmp_path, "--opensim-setup", "setup.xml", "--format", "none")
    files = {file.name: file.read_bytes() for file in (tmp_path / "out").glob("*.sto")}
    units = {f"joint0_t{axis}": "force" for axis in "xyz"}
    torques = (f"{name}_{units.get(name, 'moment')}" for name in COORDINATES)
    assert sorted(files) == sorted(
        f"walk_InducedAccelerations_{name}.sto"
        for name in (*COORDINATES, "center_of_mass", "InverseDynamics", *torques)
    )
    assert json.loads((tmp_path / "out" / "analysis.json").read_text())["files"] == [
        "analysis.json",
        *sorted(files),
    ]
    options = "walk.sto --robot leg.osim --from 0.2 --to 1.2 --cutoff 6 --filter-order 3 --induced joints"
    contact = "--contact sole:body3=pressed --contact-loads plate.xml --contact-threshold 20"
    store = "--induced centre-of-mass --induced-whole --sto walk_InducedAccelerations --sto-units deg"
    analyze(tmp_path, *options.split(), *contact.split(), *store.split(), "--format", "none")
    assert {file.name: file.read_bytes() for file in (tmp_path / "out").glob("*.sto")} == files


def test_constraints_of_a_setup_hold(tmp_path: Path) -> None:
    write_case(tmp_path, WELD, "plate.xml", "body2 body3")
    analyze(tmp_path, "--opensim-setup", "setup.xml")
    held, free = (
        read_storage(tmp_path / f"out/walk_InducedAccelerations_{body}.sto") for body in ("body3", "body2")
    )
    size = max(np.abs(column).max() for name, column in free.items() if name != "time")
    for source in ("gravity", *COORDINATES):  # velocities and the contact tell how it moves
        for end in ("X", "Y", "Z", "Ox", "Oy", "Oz"):
            assert np.abs(held[f"{source}_{end}"]).max() <= 1e-9 * size, f"{source}_{end}"
    assert np.abs(free["gravity_Y"]).max() > 1.0


def test_storage_files_are_headed_as_opensims_and_in_degrees_where_they_say_so(tmp_path: Path) -> None:
    setup = write_case(tmp_path, bodies=BODIES[1])
    analyze(tmp_path, "--opensim-setup", "setup.xml")
    in_radians = read_storage(tmp_path / "out/walk_InducedAccelerations_body1.sto")
    changed(setup, "<in_degrees>false", "<in_degrees>true")
    analyze(tmp_path, "--opensim-setup", "setup.xml")
    path = tmp_path / "out/walk_InducedAccelerations_body1.sto"
    facts = ["body1", "version=1", "nRows=101", f"nColumns={1 + 6 * 13}", "inDegrees=yes"]
    assert path.read_text().splitlines()[:5] == facts
    in_degrees = read_storage(path)
    assert list(in_degrees)[:4] == ["time", "total_X", "total_Y", "total_Z"]
    assert list(in_degrees)[-6:] == [f"velocity_{end}" for end in ("X", "Y", "Z", "Ox", "Oy", "Oz")]
    for name, values in in_radians.items():
        factor = 180 / np.pi if name.endswith(("Ox", "Oy", "Oz")) else 1.0
        assert np.abs(in_degrees[name] - factor * values).max() <= 1e-12 * max(
            np.abs(in_degrees[name]).max(), 1
        )


def test_a_setup_that_does_not_say_so_is_in_degrees(tmp_path: Path) -> None:
    """OpenSim's own default."""
    setup = changed(write_case(tmp_path), "<in_degrees>false</in_degrees>", "")
    assert read_setup(setup).options["sto_units"] == "deg"


def test_what_a_setup_says_is_not_given_again(tmp_path: Path) -> None:
    write_case(tmp_path)
    told = analyze(tmp_path, "--opensim-setup", "setup.xml", "--cutoff", "4", code=2)
    assert told == "linkwise: error: --cutoff: setup.xml says that; leave it out, or change it there\n"
    told = analyze(tmp_path, "run.sto", "--opensim-setup", "setup.xml", code=2)
    assert told.startswith("linkwise: error: LOG: setup.xml says that")
    told = analyze(tmp_path, "walk.sto", code=2)
    assert told == "linkwise: error: Missing option '--robot'. See linkwise analyze --help\n"
    told = analyze(tmp_path, "walk.sto", "--robot", "leg.osim", "--sto-units", "deg", code=2)
    assert told == "linkwise: error: --sto-units goes with --sto; add it\n"
