"""Power by source in an analysis: what links get, what flows through joints, work of both, and its figure."""

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.answers import relative_error
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import Contact, LinkwiseError, Load, Payload, generate, read_system, write_package
from linkwise.analysis import Analysis, Processing, analyze
from linkwise.package.load import import_package

LENGTH, CENTRE, MASS, INERTIA, G = 0.25, 0.125, 0.6, 5e-3, 9.80665
"""The arm of the paper's Table 2, of which generated/planar3 is made."""
ARM = robot(
    *map(link, "abcd"),
    '<link name="tool"/>',
    joint("ab", "a", "b"),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d").replace("</joint>", '<dynamics damping="0.4" friction="0.2"/></joint>'),
    joint("fixed", "d", "tool", type="fixed"),
)
FORCE = (3.0, -2.0, 5.0)
SLEDGE = """
import sympy as sp
from linkwise import Coordinate, LinkEnergy
t = time = sp.Symbol("t")
x, y = Coordinate("x", "m"), Coordinate("y", "m")
name, coordinates = "sledge", [x, y]
links = [
    LinkEnergy("sledge", 3 * x.qd**2 / 2, {"spring": 5 * x.q**2}, {"drag": 0.7 * x.qd**2 / 2}),
    LinkEnergy("load", (x.qd + y.qd)**2, {POTENTIALS}),
]
"""


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """The arm of Table 2 in motion, with two phases."""
    log = write_csv(tmp_path_factory.mktemp("swing") / "a.csv", smooth(80, 3))
    return analyze(log, PLANAR3, phases=["early/late=0..0.4", "once=0.2..0.3,0.5..0.6"], induced_power=True)


def test_the_flow_into_the_last_link_is_its_joints_force_and_torque_by_hand(swing: Analysis) -> None:
    angle, rate, change = (np.cumsum(a, axis=1) for a in (swing.q, swing.qd, swing.qdd))
    along = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    across = np.stack([-np.sin(angle), np.cos(angle)], axis=2)
    speed = LENGTH * (across * rate[..., None])[:, :2].sum(axis=1)
    turned = across * change[..., None] - along * rate[..., None] ** 2
    mass_centre = LENGTH * turned[:, :2].sum(axis=1) + CENTRE * turned[:, 2]
    force = MASS * (mass_centre + np.array([0.0, G]))
    arm = CENTRE * along[:, 2]
    torque = INERTIA * change[:, 2] + arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    by_force = (force * speed).sum(axis=1)
    assert relative_error(swing["tau/joint3"], torque) <= 1e-12
    assert relative_error(swing["flow/joint3"], by_force + torque * rate[:, 2]) <= 1e-12
    assert relative_error(swing["flow_before/joint3"], by_force + torque * rate[:, 1]) <= 1e-12
    assert relative_error(swing["flow/joint3"], swing["gain/link3"]) <= 1e-12
    assert np.abs(swing["flow_before/joint1"]).max() <= 1e-12, "the ground, which rests, gives no power"
    kinetic = 0.5 * MASS * ((speed + CENTRE * across[:, 2] * rate[:, 2:]) ** 2).sum(axis=1)
    assert relative_error(swing["energy_kinetic/link3"], kinetic + INERTIA * rate[:, 2] ** 2 / 2) <= 1e-12


@pytest.mark.parametrize("convention", ["closing", "gradient"])
def test_columns_hold_what_the_package_says_and_sum_up(tmp_path: Path, convention: str) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    log = write_csv(tmp_path / "log.csv", smooth(40, 3), ["ab", "bc", "cd"])
    loads = [Load("pull", "tool", force=FORCE), Load("push", "b", force=FORCE)]
    made = Processing(convention=convention)  # type: ignore[arg-type]
    found = analyze(log, tmp_path / "arm", processing=made, loads=loads, induced_power=True)
    module = import_package(tmp_path / "arm")
    pulls = [module.AppliedLoad("tool", FORCE), module.AppliedLoad("b", FORCE)]
    given = {"q": found.q, "qd": found.qd, "qdd": found.qdd, "loads": pulls}
    model = module.load("numpy")
    for first, shares, names in (
        ("gain", model.induced_power(**given), "bcd"),
        ("flow", model.induced_flow(**given), ("ab", "bc", "cd")),
    ):
        for r, name in enumerate(names):
            own = found[f"{first}/{name}"]
            limit = 1e-11 * np.abs(own).max()
            parts = [
                c.name for c in found.columns if c.name.startswith(f"{first}_") and f"/{name}/" in c.name
            ]
            assert np.abs(sum(found[part] for part in parts) - own).max() <= limit
            for part, value in (
                ("/{}", shares.total[:, r]),
                ("_tau/{}/bc", shares.actuators[:, r, 1]),
                ("_qd/{}/ab", shares.velocity[:, r, :, 0].sum(-1)),
                ("_gravity/{}/c", shares.gravity[:, r, 1]),
                ("_damping/{}/cd", shares.passive[:, r, 1, 2]),
                ("_friction/{}/cd", shares.passive[:, r, 2, 2]),
                ("_load/{}/pull", shares.loads[:, r, 0]),
                ("_load/{}/push", shares.loads[:, r, 1]),
            ):
                assert np.abs(found[first + part.format(name)] - value).max() <= limit, part
    before = model.induced_flow(**given, side="predecessor").total
    assert relative_error(found["flow_before/cd"], before[:, 2]) <= 1e-11
    assert found.closure.power_relative is not None
    assert found.closure.power_relative <= 1e-12


def test_nothing_flows_from_the_ground_into_a_base_whose_feet_slip(tmp_path: Path) -> None:
    """Joints, loads and contacts, which feed power in as they slip, balance the gain of all energies."""
    write_package(generate(read_system(LEG), ["numpy"]), tmp_path / "leg")
    names = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
    log = write_csv(tmp_path / "log.csv", smooth(60, 6) * [1, *[0.4] * 6], names)
    found = analyze(
        log,
        tmp_path / "leg",
        contacts=[Contact("foot", "held", (0.1, -0.06, 0.0), name="sole")],
        loads=[Load("push", "shank", force=(300, 0, 20))],
        payloads=[Payload("pelvis", 4.0, (0.1, 0.2, 0.0), name="bag")],
        induced_power=True,
    )
    gain = sum(found[f"gain/{name}"] for name in found.robot.links)
    slip = sum(values for name, values in found.table.items() if name.startswith("power_contact/"))
    assert np.abs(slip).max() > 0.1 * np.abs(gain).max()
    assert np.abs(found["flow_before/pelvis_tx"]).max() <= 1e-11 * np.abs(gain).max()
    # What a torque gives all links is its own power: slip has columns of its own.
    for i, driven in enumerate(found.robot.joints):
        given = sum(found[f"gain_tau/{name}/{driven}"] for name in found.robot.links)
        assert np.abs(given - found.torque[:, i] * found.qd[:, i]).max() <= 1e-11 * np.abs(gain).max()
    every = [c.name for c in found.columns if c.quantity.startswith("flow_") and "/ankle_angle_r/" in c.name]
    assert relative_error(sum(found[name] for name in every), found["flow/ankle_angle_r"]) <= 1e-11


def test_links_of_energies_tell_each_share(tmp_path: Path) -> None:
    (tmp_path / "sledge.py").write_text(SLEDGE.replace("{POTENTIALS}", '{"rope": y.q * (2 + t)}'))
    write_package(generate(read_system(tmp_path / "sledge.py"), ["numpy"]), tmp_path / "sledge")
    found = analyze(
        write_csv(tmp_path / "a.csv", smooth(60, 2), ["x", "y"]), tmp_path / "sledge", induced_power=True
    )
    (_, y), (u, v) = found.q.T, found.qd.T
    a, b = found.qdd.T
    # gains by hand: of the sledge, and of the load, whose rope stores more and more
    assert relative_error(found["gain/sledge"], 3 * u * a + 10 * found.q[:, 0] * u) <= 1e-11
    rope = 2 + found.time
    assert relative_error(found["gain/load"], 2 * (u + v) * (a + b) + v * rope + y) <= 1e-11
    for share, power in (("sledge/drag", -0.7 * u**2), ("sledge/spring", 0 * u), ("load/rope", y)):
        both = sum(found[f"gain_share/{name}/{share}"] for name in ("sledge", "load"))
        assert np.abs(both - power).max() <= 1e-11 * np.abs(found["gain/load"]).max(), share
    assert not any(name.startswith("flow") for name in found.table), "nobody says what hangs on what"
    (tmp_path / "two.py").write_text(SLEDGE.replace("{POTENTIALS}", '{"a": y.q * t, "b": x.q * t}'))
    write_package(generate(read_system(tmp_path / "two.py"), ["numpy"]), tmp_path / "two")
    with pytest.raises(
        LinkwiseError, match=r"^--induced-power: of link 'load', 'a', 'b' all change with time"
    ):
        analyze(tmp_path / "a.csv", tmp_path / "two", induced_power=True)


def test_work_is_the_integral_of_each_power_over_the_movement_and_its_phases(swing: Analysis) -> None:
    gain, flow = swing.dense("gain_tau"), swing.dense("flow")
    for power, name in ((gain, "gain_tau"), (flow, "flow")):
        given = np.trapezoid(np.maximum(power, 0.0), swing.time, axis=0)
        assert relative_error(swing.work_by_source[name].given, given) <= 1e-11
    on = (swing.time >= 0.2) & (swing.time <= 0.3) | (swing.time >= 0.5) & (swing.time <= 0.6)
    taken, step = np.maximum(-flow, 0.0), swing.time[1] - swing.time[0]
    own = (0.5 * (taken[1:] + taken[:-1]) * (on[1:] & on[:-1])[:, None]).sum(axis=0) * step
    assert relative_error(swing.work_in_phases[1]["flow"].taken, own) <= 1e-9
    record = swing.record()["work"]
    assert record["in_phases"][1]["phase"] == "once: from 0.2 to 0.3 s or from 0.5 to 0.6 s"
    (entry,) = (one for one in record["in_phases"][0]["flow"] if one["joint"] == "joint2")
    assert entry["net"] == swing.work_in_phases[0]["flow"].net[1]
    (whole,) = (e for e in record["gain_tau"] if (e["holder"], e["cause"]) == ("link3", "joint1"))
    assert whole["given"] == swing.work_by_source["gain_tau"].given[2, 0]


def test_the_figure_has_a_lane_for_each_segment_arrows_for_flows_and_bars_for_work(swing: Analysis) -> None:
    figure = swing.figure("energy:once")
    lanes, bars = figure.axes[:2]
    assert [label.get_text() for label in lanes.get_yticklabels()] == ["link1", "link2", "link3"]
    beside = [text.get_text().splitlines()[0] for text in lanes.texts]
    assert [text for text in beside if text.startswith("through")] == [f"through joint{k}" for k in (1, 2, 3)]
    net = swing.work_in_phases[1]["gain"].net
    (marks,) = (line for line in bars.get_lines() if line.get_label() == "in all: gain of energy")
    np.testing.assert_allclose(marks.get_xdata(), net, rtol=0, atol=1e-9 * np.abs(net).max())
    by_gravity = [box for box in bars.containers if box.get_label() == "gravity"]
    own = swing.work_in_phases[1]["gain_gravity"].net.sum(axis=1)
    np.testing.assert_allclose([box.get_width() for box in by_gravity[0]], np.maximum(own, 0.0), atol=1e-12)
    widths = [np.ptp(patch.get_xy()[:, 0]) for patch in lanes.patches]
    step = (swing.time[-1] - swing.time[0]) / 24
    np.testing.assert_allclose(max(widths), 0.9 * step, rtol=1e-9)


def test_the_seven_segments_that_most_work_is_done_on_have_lanes(tmp_path: Path) -> None:
    write_package(generate(read_system("planar9"), ["numpy"], kernel="loops"), tmp_path / "arm")
    log = write_csv(tmp_path / "a.csv", smooth(40, 9), [f"joint{k}" for k in range(1, 10)])
    found = analyze(log, tmp_path / "arm", induced_power=True)
    shown = [label.get_text() for label in found.figure("energy").axes[0].get_yticklabels()]
    assert len(shown) == 7


def test_flows_that_are_nothing_beside_the_work_are_not_told(
    swing: Analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flows() -> list[str]:
        return [
            text.get_text() for text in swing.figure("energy:once").axes[1].texts if " J" in text.get_text()
        ]

    assert len(flows()) == 3
    monkeypatch.setattr("linkwise.analysis.show.energy_figure.NOTHING", 1e6)
    assert flows() == []


def test_what_is_missing_for_the_figure_is_told(swing: Analysis, tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"^--figure energy:never: add --phase never=\.\.\., over which"):
        swing.figure("energy:never")
    log = write_csv(tmp_path / "a.csv", smooth(40, 3))
    with pytest.raises(LinkwiseError, match=r"^--figure energy: add --induced-power, whose flows it draws$"):
        analyze(log, PLANAR3).figure("energy")
    words = ["analyze", str(log), "--robot", str(PLANAR3), "--out", str(tmp_path / "out"), "--no-page"]
    done = run_linkwise(*words, "--induced-power", "--figure", "energy", folder=tmp_path)
    assert "power by source sums to what links gain within" in " ".join(done.stdout.split())
    record = json.loads((tmp_path / "out/analysis.json").read_text())
    assert {c["unit"] for c in record["columns"] if c["name"].startswith(("gain", "flow"))} == {"W"}
    assert (tmp_path / "out/energy.png").stat().st_size > 10_000
