"""Reactions in an analysis: columns against the package's own call, balances of bodies, figures, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, smooth, write_csv
from helpers.urdf_text import chain, joint
from linkwise import Load, Payload, generate, read_system, write_package
from linkwise.analysis import Contact, Processing, analyze
from linkwise.errors import LinkwiseError
from linkwise.package.load import import_package

PARTS = ("moment_x", "moment_y", "moment_z", "force_x", "force_y", "force_z")
JOINTS = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
FOOT = Contact("foot", "held", (0.1, -0.06, 0.0), name="sole")
COUPLED = """
[[constraint]]
name = "gear"
type = "coupling"
terms = { ankle_angle_r = 1, knee_angle_r = [0.1, 0.5, 0.2] }
"""
STRUT = """
[[constraint]]
name = "strut"
type = "distance"
length = 0.75
first = { frame = "pelvis", xyz = [0.2, 0.1, 0] }
second = { frame = "shank", xyz = [0.05, -0.2, 0] }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made: Path = tmp_path_factory.mktemp("reactions")
    write_package(generate(read_system(LEG), ["numpy", "autograd"]), made / "leg")
    (made / "coupled.toml").write_text(LEG.read_text() + COUPLED)
    write_package(generate(read_system(made / "coupled.toml"), ["numpy"]), made / "coupled")
    write_package(generate(read_system(DATA / "fourbar.toml"), ["numpy"]), made / "fourbar")
    moving = smooth(60, 6)
    moving[:, 1:] *= 0.4
    write_csv(made / "leg.csv", moving, JOINTS)
    write_csv(made / "coupled.csv", moving[:, :-1], JOINTS[:-1])
    (made / "strut.toml").write_text(LEG.read_text() + STRUT)
    write_package(generate(read_system(made / "strut.toml"), ["numpy"]), made / "strut")
    write_csv(made / "strut.csv", moving[:, [0, 1, 2, 3, 4, 6]], [*JOINTS[:4], JOINTS[5]])
    write_csv(made / "fourbar.csv", 0.8 + 0.1 * smooth(60, 1), ["a"])
    return made


def wrench(result: Any, name: str, head: str = "reaction", tail: str = "") -> Any:
    """One of the wrenches (S, 6) of a result."""
    return np.stack([result[f"{head}/{name}/{part}{tail}"] for part in PARTS], 1)


def sums_up(result: Any, name: str) -> None:
    """Assert that by link and load, and by cause, the shares come to the whole."""
    for part in PARTS:
        whole = result[f"reaction/{name}/{part}"]
        scale = max(1.0, np.abs(wrench(result, name)).max())
        every = {c.name: c.quantity for c in result.columns if f"/{name}/{part}/" in c.name}
        own = sum(
            result[f"reaction_{kind}/{name}/{part}"]
            for kind in ("spring", "damping", "friction", "armature")
            if f"reaction_{kind}/{name}/{part}" in result.table
        )
        for kinds in (
            ("reaction_link", "reaction_load"),
            ("reaction_qdd", "reaction_qd", "reaction_gravity", "reaction_load"),
        ):
            parts = [result[column] for column, quantity in every.items() if quantity in kinds]
            assert np.abs(sum(parts) + own - whole).max() <= 1e-10 * scale, (part, kinds)


def test_columns_are_the_shares_of_the_package_with_loads_and_payloads(folder: Path) -> None:
    push = Load("push", "shank", force=(5.0, 30.0, 0.0), point=(0.0, -0.1, 0.0))
    bag = Payload("thigh", 3.0, (0.05, -0.2, 0.0), "bag")
    name = "hip_flexion_r,shank"
    given = {"loads": [push], "payloads": [bag], "reactions": [name, "knee_angle_r"]}
    found = analyze(folder / "leg.csv", folder / "leg", **given)
    module = import_package(folder / "leg")
    robot, motion = module.load("numpy"), (found.q, found.qd, found.qdd)
    load = module.AppliedLoad("shank", push.force, point=push.point)
    shares = robot.reactions(*motion, axes="shank", joints="hip_flexion_r", loads=[load])
    shank, tilt = robot.link_index("shank"), robot.joint_index("pelvis_tilt")
    for head, tail, expected in (
        ("reaction_gravity", "/shank", shares.gravity[:, 0, shank]),
        ("reaction_qd", "/pelvis_tilt", shares.velocity[:, 0, :, tilt].sum(1)),
        ("reaction_load", "/push", shares.loads[:, 0, 0]),
    ):
        own = wrench(found, name, head, tail)
        if head == "reaction_qd":  # of the bag too, which is no link of the package
            bare = analyze(folder / "leg.csv", folder / "leg", **{**given, "payloads": []})
            own = wrench(bare, name, head, tail)
        np.testing.assert_allclose(own, expected, rtol=0, atol=1e-9)
    # Newton's law: a payload adds what it takes to accelerate it against its weight.
    moved = robot.kinematics.acceleration(*motion, "thigh", point=bag.point)[:, 3:] + [0.0, 9.80665, 0.0]
    turn = robot.kinematics.pose(found.q, "shank")[:, :3, :3]
    expected = bag.mass * np.einsum("sxa,sx->sa", turn, moved)
    np.testing.assert_allclose(wrench(found, name, tail="/bag")[:, 3:], expected, rtol=0, atol=1e-9)
    for one in (name, "knee_angle_r"):
        sums_up(found, one)
    np.testing.assert_allclose(
        found["reaction/knee_angle_r/moment_z"], found["tau/knee_angle_r"], rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("package", ["leg", "coupled", "strut"])
def test_a_knee_that_stands_bears_what_the_ground_and_the_bodies_behind_it_ask(
    folder: Path, package: str
) -> None:
    push = Load("push", "shank", force=(5.0, 30.0, 0.0), point=(0.0, -0.1, 0.0))
    name = "knee_angle_r,world"
    log = folder / f"{package}.csv"
    found = analyze(log, folder / package, loads=[push], contacts=[FOOT], reactions=[name])
    robot = import_package(folder / "leg").load("numpy")
    module = import_package(folder / "leg")
    ground = found.contact_wrench[:, 0]
    loads = [
        module.AppliedLoad("shank", push.force, point=push.point),
        module.AppliedLoad("foot", ground[:, 3:], ground[:, :3], point=FOOT.point),
    ]
    if package == "strut":
        ends = [
            (robot.kinematics.pose(found.q, body) @ [*place, 0.0, 1.0])[:, :3]
            for body, place in (("pelvis", (0.2, 0.1)), ("shank", (0.05, -0.2)))
        ]
        along = (ends[0] - ends[1]) / 0.75
        pushed = -found["force/strut force"][:, None] * along
        assert np.abs(pushed).max() > 1.0
        loads.append(module.AppliedLoad("shank", pushed, at=ends[1]))
    motion = found.q, found.qd, found.qdd
    expected = robot.reactions(*motion, axes="world", joints="knee_angle_r", loads=loads).total[:, 0]
    np.testing.assert_allclose(wrench(found, name), expected, rtol=0, atol=1e-8)
    sums_up(found, name)


def test_a_pin_of_a_loop_bears_what_the_package_says(folder: Path) -> None:
    found = analyze(folder / "fourbar.csv", folder / "fourbar", reactions=["b"])
    robot = import_package(folder / "fourbar").load("numpy")
    shares = robot.reactions(found.q, found.qd, found.qdd, joints="b")
    np.testing.assert_allclose(wrench(found, "b"), shares.total[:, 0], rtol=0, atol=1e-9)
    own = wrench(found, "b", "reaction_qd", "/a")
    np.testing.assert_allclose(own, shares.velocity[:, 0, :, 0].sum(1), rtol=0, atol=1e-9)
    sums_up(found, "b")
    assert not [c.name for c in found.columns if c.name.startswith("reaction_qd/b/force_x/c")]


def test_in_the_gradient_convention_velocities_count_twice(folder: Path) -> None:
    kinds = [Processing(convention=name) for name in ("closing", "gradient")]
    closing, gradient = (
        analyze(folder / "leg.csv", folder / "leg", processing=made, reactions=["knee_angle_r"])
        for made in kinds
    )
    one, two = (wrench(found, "knee_angle_r", "reaction_qd", "/pelvis_tilt") for found in (closing, gradient))
    np.testing.assert_allclose(two, 2.0 * one, rtol=1e-12)


def test_a_figure_shows_the_whole_and_its_causes(folder: Path) -> None:
    push = Load("push", "shank", force=(5.0, 30.0, 0.0))
    found = analyze(folder / "leg.csv", folder / "leg", loads=[push], reactions=["knee_angle_r"])
    panels = found.figure("reaction:knee_angle_r").axes
    assert [panel.get_ylabel() for panel in panels] == ["moment z (N·m)", "force x (N)", "force y (N)"]
    for part, panel in zip(("moment_z", "force_x", "force_y"), panels, strict=True):
        lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
        whole = lines.pop("all together")
        np.testing.assert_allclose(whole, found[f"reaction/knee_angle_r/{part}"], rtol=1e-12)
        shares = [y for label, y in lines.items() if not label.startswith("_")]
        np.testing.assert_allclose(sum(shares), whole, rtol=0, atol=1e-9)
        assert {"gravity", "load push"} <= lines.keys()


def test_a_joint_that_turns_in_space_has_six_panels(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(chain(*(joint(name, a, b) for name, a, b in ("pab", "qbc"))))
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    log = write_csv(tmp_path / "arm.csv", smooth(40, 2), ["p", "q"])
    panels = analyze(log, tmp_path / "arm", reactions=["q"]).figure("reaction:q").axes
    assert [panel.get_ylabel().partition(" (")[0] for panel in panels] == [
        part.replace("_", " ") for part in PARTS
    ]


def test_what_cannot_be_told_is_refused_by_name(folder: Path) -> None:
    for reactions, told in (
        (["kneee"], "--reaction kneee: leg has no joint 'kneee'; its joints are knee_angle_r"),
        (["knee_angle_r,shin"], "--reaction knee_angle_r,shin: not joint, not world, and of bodies 'shin'"),
        (["knee_angle_r", "knee_angle_r"], "--reaction knee_angle_r is given twice"),
    ):
        with pytest.raises(LinkwiseError, match=told):
            analyze(folder / "leg.csv", folder / "leg", reactions=reactions)
    asked = ["analyze", folder / "leg.csv", "--robot", folder / "leg", "--out", folder / "out"]
    for more, told in (
        (["--figure", "reaction:knee_angle_r"], "add --reaction knee_angle_r, whose shares it draws"),
        (["--reaction", "knee_angle_r", "--backend", "autograd"], "leave --backend autograd out"),
    ):
        run = run_linkwise(*asked, *more, folder=folder)
        assert run.returncode == 2, run.stderr
        assert told in run.stderr.replace("\n", " ")
