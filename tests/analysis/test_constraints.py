"""Robots whose joints are tied, in analyses: a four-bar against its one equation of motion.

With the crank's angle x, the places of all masses are functions of x alone, found by intersecting circles:

    tau = I(x) x'' + I'(x) x'^2 / 2 + V'(x)

by finite differences, which know nothing of joints, trees and multipliers.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.motion_logs import write_csv
from linkwise import LinkwiseError, Load, Payload, generate, identify, read_system, write_package
from linkwise.analysis import Processing, Reading, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.run import analyze_to
from linkwise.analysis.settings import Lowpass
from linkwise.analysis.show.page import page_data
from linkwise.progress import silent

CRANK, COUPLER, ROCKER, APART = 0.2, 0.5, 0.4, 0.5
MASSES = {"crank": (1.0, 0.1, 0.01), "coupler": (2.0, 0.25, 0.04), "rocker": (1.5, 0.2, 0.02)}
"""kg, m along the link, kg m^2 about the centre of mass."""
GRAVITY = 9.81
FOUR_BAR = """schema = 1
name = "four_bar"
gravity = [0, -9.81, 0]
link = [
    {name = "crank", mass = 1, com = [0.1, 0, 0], inertia = {yy = 0.01, zz = 0.01}},
    {name = "coupler", mass = 2, com = [0.25, 0, 0], inertia = {yy = 0.04, zz = 0.04}},
    {name = "rocker", mass = 1.5, com = [0.2, 0, 0], inertia = {yy = 0.02, zz = 0.02}},
]
joint = [
    {name = "turn", parent = "base", child = "crank", stiffness = 2.0, rest = 0.2},
    {name = "bend", parent = "crank", child = "coupler", xyz = [0.2, 0, 0], damping = 0.3},
    {name = "swing", parent = "base", child = "rocker", xyz = [0.5, 0, 0], rpy = [0, 0, 1.5707963267948966]},
]
[[constraint]]
name = "pin"
type = "point"
first = {frame = "coupler", xyz = [0.5, 0, 0]}
second = {frame = "rocker", xyz = [0.4, 0, 0]}
"""
ALL = Processing(edges="trim")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot, and logs of its crank alone and of all its joints."""
    made: Path = tmp_path_factory.mktemp("four_bar")
    (made / "robot.toml").write_text(FOUR_BAR)
    write_package(generate(read_system(made / "robot.toml"), ["numpy"]), made / "robot")
    time = np.arange(400) / 100
    turn = 1.0 + 0.9 * np.sin(2 * time)
    write_csv(made / "crank.csv", np.column_stack([time, turn]), ["turn"])
    _, coupler, rocker = angles(turn)
    whole = np.column_stack([time, turn, coupler - turn, rocker - np.pi / 2])
    write_csv(made / "joints.csv", whole, ["turn", "bend", "swing"])
    return made


def angles(x: Any, elbow: float = 1.0) -> tuple[Any, Any, Any]:
    """Angles of crank, coupler and rocker: circles about the crank's end and the rocker's foot meet."""
    a = np.array([CRANK * np.cos(x), CRANK * np.sin(x)])
    foot = np.array([APART + 0.0 * x, 0.0 * x])
    way = foot - a
    far = np.hypot(*way)
    along = (far**2 + COUPLER**2 - ROCKER**2) / (2 * far)
    across = elbow * np.sqrt(COUPLER**2 - along**2)
    pin = a + along * way / far + across * np.array([-way[1], way[0]]) / far
    return x, np.arctan2(*(pin - a)[::-1]), np.arctan2(*(pin - foot)[::-1])


def places(x: Any) -> dict[str, tuple[Any, Any]]:
    """Return the centre of mass of each link, and its angle."""
    starts = (0.0, 0.0), (CRANK * np.cos(x), CRANK * np.sin(x)), (APART, 0.0)
    found = {}
    for (name, (_, reach, _)), start, angle in zip(MASSES.items(), starts, angles(x), strict=True):
        found[name] = (start[0] + reach * np.cos(angle), start[1] + reach * np.sin(angle)), angle
    return found


def slope(of: Any, x: Any, h: float = 2e-3) -> Any:
    """Derivative to O(h^8)."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    return sum(w * (of(x + k * h) - of(x - k * h)) for k, w in weights.items()) / h


def share_of(name: str, x: Any, xd: Any, xdd: Any, mass: Any = None) -> tuple[Any, Any, Any]:
    """Return what the crank gives for a link: by acceleration, by velocity, by weight."""
    m, _, inertia = MASSES[name] if mass is None else (mass[0], None, 0.0)

    def point(at: Any) -> Any:
        centre, angle = places(at)[name]
        if mass is None:
            return centre
        reach = MASSES[name][1]
        return tuple(c + (mass[1] - reach) * f(angle) for c, f in zip(centre, (np.cos, np.sin), strict=True))

    def inertia_of(at: Any) -> Any:
        vx, vy = slope(lambda y: point(y)[0], at), slope(lambda y: point(y)[1], at)
        return m * (vx**2 + vy**2) + inertia * slope(lambda y: places(y)[name][1], at) ** 2

    weight = m * GRAVITY * slope(lambda y: point(y)[1], x)
    return inertia_of(x) * xdd, 0.5 * slope(inertia_of, x) * xd**2, weight


def motion(result: Any) -> tuple[Any, Any, Any]:
    return result.q[:, 0], result.qd[:, 0], result.qdd[:, 0]


def test_the_crank_gives_what_its_one_equation_of_motion_says_link_by_link(folder: Path) -> None:
    result = analyze(folder / "crank.csv", folder / "robot", processing=ALL)
    assert [c.name for c in result.columns if c.quantity == "tau"] == ["tau/turn"]
    for j, name in enumerate(MASSES):
        acceleration, velocity, gravity = share_of(name, *motion(result))
        np.testing.assert_allclose(result.acceleration[:, 0, j, 0], acceleration, rtol=0, atol=1e-9)
        np.testing.assert_allclose(result.velocity[:, 0, j, 0], velocity, rtol=0, atol=1e-8)
        np.testing.assert_allclose(result.gravity[:, 0, j], gravity, rtol=0, atol=1e-9)
    assert not result.partial_torque[:, 1:].any(), "joints that follow give nothing"


def test_the_gradient_convention_counts_what_changes_the_cranks_inertia_twice(folder: Path) -> None:
    gradient = replace(ALL, convention="gradient")
    result = analyze(folder / "crank.csv", folder / "robot", processing=gradient)
    for j, name in enumerate(MASSES):
        _, velocity, _ = share_of(name, *motion(result))
        np.testing.assert_allclose(result.velocity[:, 0, j, 0], 2 * velocity, rtol=0, atol=1e-8)


def test_a_payload_counts_in_the_gradient_convention_as_links_do(folder: Path) -> None:
    bag = Payload("coupler", 0.7, (0.4, 0.0, 0.0), "bag")
    made = [
        analyze(
            folder / "crank.csv", folder / "robot", processing=replace(ALL, convention=one), payloads=[bag]
        )
        for one in ("closing", "gradient")
    ]
    closing, gradient = (result["tau_qd/turn/bag/turn"] for result in made)
    np.testing.assert_allclose(gradient, 2.0 * closing, rtol=1e-12, atol=1e-12)
    assert np.abs(gradient).max() > 0.1


def test_springs_losses_loads_and_payloads_anywhere_are_borne_by_the_crank(folder: Path) -> None:
    pull = Load("pull", "rocker", force=(3.0, -2.0, 0.0), point=(0.1, 0.0, 0.0))
    bag = Payload("coupler", 0.7, (0.4, 0.0, 0.0), "bag")
    result = analyze(folder / "crank.csv", folder / "robot", processing=ALL, loads=[pull], payloads=[bag])
    x, xd, _ = motion(result)
    np.testing.assert_allclose(result["tau_spring/turn"], 2.0 * (x - 0.2), rtol=0, atol=1e-12)
    bend = slope(lambda at: angles(at)[1] - at, x)
    np.testing.assert_allclose(result["tau_damping/turn"], 0.3 * bend**2 * xd, rtol=0, atol=1e-9)
    at = [slope(lambda y, f=f: 0.1 * f(angles(y)[2]), x) for f in (np.cos, np.sin)]
    np.testing.assert_allclose(result["tau_load/turn/pull"], -(3.0 * at[0] - 2.0 * at[1]), rtol=0, atol=1e-9)
    carried = sum(share_of("coupler", *motion(result), mass=(0.7, 0.4)))
    np.testing.assert_allclose(result["tau/turn/bag"], carried, rtol=0, atol=1e-8)
    parts = [result[name] for name in ("tau_spring/turn", "tau_damping/turn", "tau_load/turn/pull")]
    np.testing.assert_allclose(
        result.torque[:, 0], result.partial_torque[:, 0].sum(1) + sum(parts), atol=1e-12
    )


def test_the_pin_bears_what_the_rocker_needs_to_swing(folder: Path) -> None:
    pull = Load("pull", "rocker", force=(3.0, -2.0, 0.0), point=(0.1, 0.0, 0.0))
    result = analyze(folder / "crank.csv", folder / "robot", processing=ALL, loads=[pull])
    swing, swung = result.q[:, 2] + np.pi / 2, result.qdd[:, 2]
    mass, reach, inertia = MASSES["rocker"]
    needed = (inertia + mass * reach**2) * swung + mass * GRAVITY * reach * np.cos(swing)
    needed = needed - 0.1 * (np.cos(swing) * -2.0 - np.sin(swing) * 3.0)
    # The pin pulls the coupler by `force`, and the rocker the other way.
    fx, fy = -result["force/pin force_x"], -result["force/pin force_y"]
    np.testing.assert_allclose(ROCKER * (np.cos(swing) * fy - np.sin(swing) * fx), needed, rtol=0, atol=1e-9)
    by_link = result.constraint_force_by_link
    assert by_link.shape == (len(swing), 3, 3)
    np.testing.assert_allclose(by_link[:, 0], 0.0, atol=1e-12)  # the crank turns about its own pin


def test_each_source_alone_accelerates_crank_and_rocker_by_the_one_equation_of_motion(
    folder: Path, tmp_path: Path
) -> None:
    geared = FOUR_BAR.replace('name = "swing",', 'name = "swing", armature = 0.05,')
    (tmp_path / "geared.toml").write_text(geared)
    write_package(generate(read_system(tmp_path / "geared.toml"), ["numpy"]), tmp_path / "geared")
    pull = Load("pull", "rocker", force=(3.0, -2.0, 0.0), point=(0.1, 0.0, 0.0))
    bag = Payload("coupler", 0.7, (0.4, 0.0, 0.0), "bag")
    result = analyze(
        folder / "crank.csv",
        tmp_path / "geared",
        processing=ALL,
        loads=[pull],
        payloads=[bag],
        induced=["joints", "rocker,0.4,0,0"],
    )
    x, xd, _ = motion(result)
    every = [(name, None) for name in MASSES] + [("coupler", (0.7, 0.4))]
    follows = slope(lambda at: angles(at)[2], x)
    further = slope(lambda at: slope(lambda y: angles(y)[2], at), x)
    inertia = sum(share_of(name, x, xd, 1.0, mass)[0] for name, mass in every) + 0.05 * follows**2
    own = {"tau": result.torque[:, 0]}
    for title, (name, mass) in zip((*MASSES, "bag"), every, strict=True):
        own[f"gravity/{title}"] = -share_of(name, x, xd, 1.0, mass)[2]
    bend = slope(lambda at: angles(at)[1] - at, x)
    own |= {"spring/turn": -2.0 * (x - 0.2), "damping/bend": -0.3 * bend**2 * xd}
    at = [slope(lambda y, f=f: 0.1 * f(angles(y)[2]), x) for f in (np.cos, np.sin)]
    own["load/pull"] = 3.0 * at[0] - 2.0 * at[1]
    motions = sum(share_of(name, x, xd, 1.0, mass)[1] for name, mass in every)
    motions = -(motions + 0.05 * follows * further * xd**2) / inertia
    by_velocities = {"turn": motions, "swing": follows * motions + further * xd**2}
    for joint, factor in (("turn", 1.0), ("swing", follows)):
        for source, force in own.items():
            kind, _, cause = source.partition("/")
            found = result[f"acc_{kind}/joints/{joint}/{cause or 'turn'}"]
            np.testing.assert_allclose(found, factor * force / inertia, rtol=0, atol=1e-8, err_msg=source)
        prefixes = tuple(f"acc_{kind}/joints/{joint}/" for kind in ("qd", "constraint", "kinematic"))
        there = sum(result[c.name] for c in result.columns if c.name.startswith(prefixes))
        np.testing.assert_allclose(there, by_velocities[joint], rtol=0, atol=1e-6)
    tip = [slope(lambda y, f=f: 0.4 * f(angles(y)[2]), x) for f in (np.cos, np.sin)]
    for component, moved in zip("xy", tip, strict=True):
        found = result[f"acc_gravity/rocker,0.4,0,0/{component}/bag"]
        np.testing.assert_allclose(found, moved * own["gravity/bag"] / inertia, rtol=0, atol=1e-8)
    assert result.closure.induced_relative is not None
    assert result.closure.induced_relative <= 1e-12


def test_a_log_of_all_joints_is_closed_and_says_how_far_off_it_was(folder: Path, tmp_path: Path) -> None:
    table = np.loadtxt(folder / "joints.csv", delimiter=",", skiprows=1)
    exact = analyze(folder / "joints.csv", folder / "robot")
    alone = analyze(folder / "crank.csv", folder / "robot")
    np.testing.assert_allclose(exact.torque, alone.torque, rtol=0, atol=1e-9)
    assert exact.record()["constraints"]["largest_violation"] < 1e-12
    assert alone.record()["constraints"]["largest_violation"] is None
    table[:, 3] += 0.005
    off = analyze(write_csv(tmp_path / "off.csv", table, ["turn", "bend", "swing"]), folder / "robot")
    np.testing.assert_allclose(off.torque, alone.torque, rtol=0, atol=1e-9)
    assert off.record()["constraints"]["largest_violation"] == pytest.approx(0.4 * 0.005, rel=0.1)
    with pytest.raises(
        LinkwiseError, match=r"off.csv: time .* s: pin force_. is open by 0.0\d* .* than 0.001"
    ):
        analyze(tmp_path / "off.csv", folder / "robot", Reading(loop_tolerance=0.001))


def test_how_far_a_log_is_off_is_told_of_its_worst_part(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("linkwise.analysis.closed_motion.BLOCK", 100)
    table = np.loadtxt(folder / "joints.csv", delimiter=",", skiprows=1)
    table[150:160, 3] += 0.005
    off = analyze(write_csv(tmp_path / "off.csv", table, ["turn", "bend", "swing"]), folder / "robot")
    assert off.record()["constraints"]["largest_violation"] == pytest.approx(0.4 * 0.005, rel=0.1)


def test_columns_of_joints_that_follow_choose_the_way_in_which_a_loop_closes(
    folder: Path, tmp_path: Path
) -> None:
    time = np.arange(400) / 100
    turn = 1.0 + 0.9 * np.sin(2 * time)
    _, coupler, rocker = angles(turn, elbow=-1.0)
    whole = np.column_stack([time, turn, coupler - turn, rocker - np.pi / 2])
    other = analyze(write_csv(tmp_path / "down.csv", whole, ["turn", "bend", "swing"]), folder / "robot")
    np.testing.assert_allclose(other.q, whole[:, 1:], rtol=0, atol=1e-9)
    some = analyze(write_csv(tmp_path / "some.csv", whole[:, [0, 1, 3]], ["turn", "swing"]), folder / "robot")
    np.testing.assert_allclose(some.q, whole[:, 1:], rtol=0, atol=1e-9)
    upper = analyze(folder / "crank.csv", folder / "robot")
    np.testing.assert_allclose(upper.q[:, 1], angles(turn)[1] - turn, rtol=0, atol=1e-9)


def test_a_loop_that_cannot_follow_is_refused_at_its_time(folder: Path, tmp_path: Path) -> None:
    far = FOUR_BAR.replace("xyz = [0.5, 0, 0], rpy", "xyz = [0.8, 0, 0], rpy")
    (tmp_path / "far.toml").write_text(far)
    write_package(generate(read_system(tmp_path / "far.toml"), ["numpy"]), tmp_path / "far")
    time = np.arange(100) / 100
    log = write_csv(tmp_path / "log.csv", np.column_stack([time, 0.2 + 3.0 * time]), ["turn"])
    with pytest.raises(
        LinkwiseError, match=r"log.csv: time 0\.\d+ s: the joints that follow turn cannot be led there"
    ):
        analyze(log, tmp_path / "far")


def test_a_motion_that_a_filter_carries_out_of_reach_is_refused(folder: Path, tmp_path: Path) -> None:
    """The crank of the far rocker gets to 1.989 rad; a low-pass overshoots a step to 1.986 rad."""
    far = FOUR_BAR.replace("xyz = [0.5, 0, 0], rpy", "xyz = [0.8, 0, 0], rpy")
    (tmp_path / "far.toml").write_text(far)
    write_package(generate(read_system(tmp_path / "far.toml"), ["numpy"]), tmp_path / "far")
    time = np.arange(200) / 100
    step = 1.0 + 0.493 * (1.0 + np.tanh(60.0 * (time - 1.0)))
    log = write_csv(tmp_path / "log.csv", np.column_stack([time, step]), ["turn"])
    assert analyze(log, tmp_path / "far").q[:, 0].max() < 1.989
    with pytest.raises(LinkwiseError, match=r"log.csv: between 0 and 1\.99 s: pin does not close at sample"):
        analyze(log, tmp_path / "far", processing=Processing(lowpass=Lowpass(6.0)))


def test_page_table_and_record_have_the_joints_that_are_driven(folder: Path, tmp_path: Path) -> None:
    robot, wanted = load_robot(folder / "robot"), Outputs("csv", ("paper", "shares", "power"))
    result, files = analyze_to(tmp_path / "out", folder / "crank.csv", robot, Request(outputs=wanted), silent)
    assert {file.name for file in files} >= {
        "analysis.csv",
        "paper.png",
        "shares.png",
        "power.png",
        "report.html",
    }
    record = json.loads((tmp_path / "out" / "analysis.json").read_text())
    assert record["constraints"]["independent"] == ["turn"]
    assert {"force/pin force_x", "force/pin force_x/coupler"} <= {
        column["name"] for column in record["columns"]
    }
    data = json.loads(page_data(result))
    assert [joint["name"] for joint in data["joints"]] == ["turn"]
    assert sorted(data["bodies"]["coordinates"]) == [0, 1, 2]
    with pytest.raises(LinkwiseError, match="paper:JOINT with a joint of turn"):
        result.figure("paper:bend")


def test_links_and_losses_are_identified_from_the_cranks_angle_and_torque_alone(
    folder: Path, tmp_path: Path
) -> None:
    time = np.arange(1600) / 200
    sizes, rates, starts = (
        np.array([[0.6], [0.3], [0.2]]),
        np.array([[1.1], [2.3], [3.7]]),
        [[0.0], [1.0], [2.0]],
    )
    at = rates * time + starts
    x = 1.0 + (sizes * np.sin(at)).sum(0)
    xd, xdd = (sizes * rates * np.cos(at)).sum(0), -(sizes * rates**2 * np.sin(at)).sum(0)
    bend = slope(lambda at: angles(at)[1] - at, x)
    torque = sum(sum(share_of(name, x, xd, xdd)) for name in MASSES) + 2.0 * (x - 0.2) + 0.3 * bend**2 * xd
    log = write_csv(tmp_path / "log.csv", np.column_stack([time, x, torque]), ["turn", "tau/turn"])
    found = identify(log, folder / "robot")
    assert found.joints == ("turn",)
    assert found.followers == ("bend", "swing")
    assert found.warnings == ()
    np.testing.assert_allclose(found.fit.friction, [[0, 0], [0.3, 0], [0, 0]], rtol=0, atol=1e-5)
    own = found.base.combinations @ found.own.reshape(-1)
    np.testing.assert_allclose(found.fit.beta, own, rtol=0, atol=1e-5)
    table = np.loadtxt(folder / "joints.csv", delimiter=",", skiprows=1)
    table[:, 3] += 0.05
    off = np.column_stack([table, table[:, 1]])
    log = write_csv(tmp_path / "off.csv", off, ["turn", "bend", "swing", "tau/turn"])
    with pytest.raises(LinkwiseError, match=r"off.csv: time .* s: pin force_. is open by"):
        identify(log, folder / "robot")


def test_joints_that_follow_are_found_from_the_logs_own_first_sample(folder: Path, tmp_path: Path) -> None:
    """These bars lie on one line with all joints at zero, where the loop is singular."""
    flat = FOUR_BAR.replace("xyz = [0.5, 0, 0], rpy = [0, 0, 1.5707963267948966]", "xyz = [0.3, 0, 0]")
    (tmp_path / "flat.toml").write_text(flat)
    write_package(generate(read_system(tmp_path / "flat.toml"), ["numpy"]), tmp_path / "flat")
    time = np.arange(100) / 100
    log = write_csv(tmp_path / "log.csv", np.column_stack([time, 0.8 + 0.2 * np.sin(3 * time)]), ["turn"])
    result = analyze(log, tmp_path / "flat")
    tip = 0.2 * np.exp(1j * result.q[:, 0]) + 0.5 * np.exp(1j * (result.q[:, 0] + result.q[:, 1]))
    np.testing.assert_allclose(tip, 0.3 + 0.4 * np.exp(1j * result.q[:, 2]), rtol=0, atol=1e-12)
