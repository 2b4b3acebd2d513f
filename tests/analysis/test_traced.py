"""Traces in an analysis: what velocities ask for, by the sources that they came from; words for mistakes."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.motion_logs import LEG, smooth, write_csv
from linkwise import LinkwiseError, Load, Options, Payload, generate, read_system, write_package
from linkwise.analysis import Contacts, Processing, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.cli.analyze import app
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact
from typer.testing import CliRunner


def package(spec: Any, folder: Path, **options: Any) -> tuple[Path, Any]:
    system = read_system(spec, Options(**options))
    write_package(generate(system, ["numpy"]), folder / "robot")
    return folder / "robot", system


def log(folder: Path, names: list[str], samples: int = 300, size: float = 0.4) -> Path:
    table = smooth(samples, len(names), 200.0)
    table[:, 1:] *= size
    return write_csv(folder / "log.csv", table, names)


def check_closes(found: Any, limit: float) -> None:
    """Each joint's velocity is the sum of its parts; what velocities ask is the sum of what parts ask."""
    names = [column.name for column in found.columns]
    for i, joint in enumerate(found.robot.joints):
        parts = [name for name in names if name.startswith(f"qd_from/{joint}/")]
        if parts:
            assert np.abs(sum(found[name] for name in parts) - found.qd[:, i]).max() <= limit
    for joint, cause in product(found.robot.joints, found.robot.joints):
        parts = [name for name in names if name.startswith(f"tau_from/{joint}/{cause}/")]
        asked = [
            c for c in found.columns if c.name.startswith(f"tau_qd/{joint}/") and c.name.endswith(f"/{cause}")
        ]
        assert bool(parts) == bool(asked)
        if parts:
            expected = sum(found[column.name] for column in asked)
            error = np.abs(sum(found[name] for name in parts) - expected).max()
            assert error <= 10.0 * limit * max(1.0, np.abs(expected).max())
    assert found.closure.trace_absolute <= limit


def test_columns_are_those_of_the_package_and_sum_to_what_velocities_ask(tmp_path: Path) -> None:
    robot, system = package(LEG, tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    load = Load("push", system.links[-1].name, force=(30.0, 50.0, 0.0))
    found = analyze(log(tmp_path, names), robot, loads=[load], trace=["all"], trace_windows=0.5)
    check_closes(found, 1e-8)
    package_ = import_package(robot)
    model = package_.load()
    applied = [package_.AppliedLoad(load.body, load.force)]
    time = found.time - found.time[0]
    expected = model.trace(found.q, found.qd, found.qdd, time, loads=applied, windows=0.5)
    for s, source in enumerate(expected.sources):
        own = source.replace(f"load:{load.body}", "load:push")
        for w, (begin, end) in enumerate(expected.windows):
            name = f"{own} {begin:.15g}..{end:.15g} s"
            if f"qd_from/{names[1]}/{name}" not in found.table:
                assert not expected.velocity[..., s, w].any()
                continue
            np.testing.assert_allclose(
                found[f"qd_from/{names[1]}/{name}"], expected.velocity[:, 1, s, w], rtol=1e-9, atol=1e-9
            )
            np.testing.assert_allclose(
                found[f"tau_from/{names[0]}/{names[1]}/{name}"],
                expected.velocity_torque[:, 0, 1, s, w],
                rtol=1e-9,
                atol=1e-8,
            )
            np.testing.assert_allclose(found[f"kinetic_from/{name}"], expected.energy[:, s, w], atol=1e-8)


def test_a_trace_does_not_depend_on_the_blocks_in_which_it_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, system = package(LEG, tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    moving = smooth(300, 1, 200.0)
    force = np.column_stack([moving[:, 0], 50.0 * moving[:, 1], 9.0 + moving[:, 0], 0.0 * moving[:, 0]])
    body = system.links[-1].name
    columns = [f"{body}/force_{axis}" for axis in "xyz"]
    write_csv(tmp_path / "loads.csv", force, columns)
    given = log(tmp_path, names), robot
    more: Any = {"loads": [tmp_path / "loads.csv"], "trace": [names[0]], "trace_restart": ["0.7"]}
    whole = analyze(*given, **more)
    monkeypatch.setattr("linkwise.analysis.stream.INNER", 7)
    monkeypatch.setattr("linkwise.analysis.stream.LEAST", 7)
    monkeypatch.setattr("linkwise.analysis.stream.BLOCK_BYTES", 1)
    pieces = analyze(*given, **more)
    np.testing.assert_allclose(pieces.values, whole.values, rtol=1e-9, atol=1e-9)
    at = int(np.argmin(np.abs(whole.time - 0.7)))
    np.testing.assert_allclose(whole[f"qd_from/{names[0]}/start"][at], whole.qd[at, 0], rtol=1e-12)


def test_payloads_are_carried_in_a_trace(tmp_path: Path) -> None:
    robot, system = package(LEG, tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    heavy = Payload(system.links[1].name, 5.0, (0.1, 0.0, 0.0))
    found = analyze(log(tmp_path, names), robot, payloads=[heavy], trace=["all"])
    check_closes(found, 1e-8)


def test_payloads_are_carried_in_a_trace_of_a_robot_that_was_made_for_native_alone(tmp_path: Path) -> None:
    write_package(generate(read_system("planar3"), ["native"]), tmp_path / "robot")
    robot = load_robot(tmp_path / "robot", "native")
    heavy = Payload(robot.links[1], 5.0, (0.1, 0.0, 0.0))
    found = analyze(log(tmp_path, list(robot.joints)), robot, payloads=[heavy], trace=["all"])
    check_closes(found, 1e-8)


def test_tied_joints_are_traced_in_independent_ones(tmp_path: Path) -> None:
    robot, _ = package(DATA / "crank_rocker.toml", tmp_path)
    own = import_package(robot).load().constraints.independent
    found = analyze(log(tmp_path, list(own), size=0.3), robot, trace=["all"])
    check_closes(found, 1e-7)
    assert {c.name for c in found.columns if c.name.startswith("kinetic_from")} == {
        f"kinetic_from/{name}" for name in (f"torque:{own[0]}", "gravity", "start")
    }


def test_tensors_are_refused_where_arrays_are_needed(tmp_path: Path) -> None:
    write_package(generate(read_system(DATA / "crank_rocker.toml"), ["numpy", "torch"]), tmp_path / "robot")
    own, torch = log(tmp_path, ["crank"], size=0.3), load_robot(tmp_path / "robot", "torch")
    for asked in ({"trace": ["all"]}, {"induced_power": True}, {"induced": ["joints"]}):
        for carried in ([], [Payload(torch.links[0], 5.0)]):  # the payload's own model is in arrays
            with pytest.raises(LinkwiseError, match="--backend torch computes in tensors"):
                analyze(own, torch, payloads=carried, **asked)  # type: ignore[arg-type]


def test_the_force_of_each_contact_is_a_source(tmp_path: Path) -> None:
    robot, system = package(LEG, tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    foot = Contact(system.links[-1].name, "held", name="foot")
    found = analyze(log(tmp_path, names, size=0.1), robot, contacts=Contacts((foot,)), trace=["all"])
    check_closes(found, 1e-6)
    assert "contact:foot" in found.traced["sources"]
    assert found.traced["weight"] == "apart"
    assert np.abs(found[f"qd_from/{names[-1]}/contact:foot"]).max() > 0.1


def test_measured_torques_are_sources_and_what_they_leave_is_the_residual(tmp_path: Path) -> None:
    """One joint's torque is measured at half of what its motion needs, one not at all; in N mm.

    Between samples, measured torques go by cubics, which is less than 1e-6 off at 200 Hz.
    """
    robot, system = package(LEG, tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    table = smooth(300, len(names), 200.0)
    given = write_csv(tmp_path / "log.csv", table, names)
    whole = analyze(given, robot)
    gains = dict.fromkeys(names[1:], 1000.0) | {names[1]: 500.0}
    columns = {f"motor {joint}": joint for joint in gains}
    read = [gain * whole[f"tau/{joint}"] for joint, gain in gains.items()]
    both = write_csv(tmp_path / "both.csv", np.column_stack([table, *read]), [*names, *columns])
    asked: Any = {"processing": Processing(start=0.3), "trace": ["all"], "trace_windows": 0.5}
    needed = analyze(given, robot, **asked)
    found = analyze(both, robot, **asked, trace_torque=columns, trace_torque_factor=1e-3)
    check_closes(found, 1e-7)
    ends = f"qd_from/{names[0]}/gravity"
    for window in [c.name.removeprefix(ends) for c in found.columns if c.name.startswith(ends)]:

        def part(of: Any, source: str, at: str = window) -> Any:
            return of[f"qd_from/{names[0]}/{source}{at}"]

        half = 0.5 * part(needed, f"residual:{names[1]}")
        np.testing.assert_allclose(part(found, f"torque:{names[1]}"), half, atol=1e-6)
        left = half + part(needed, f"residual:{names[0]}")
        np.testing.assert_allclose(part(found, "residual"), left, atol=1e-6)
        assert f"qd_from/{names[0]}/torque:{names[0]}{window}" not in found.table
    assert found.traced["measured"] == {joint: column for column, joint in columns.items()}


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--trace", "elbow"], "--trace elbow: no such joint; there are joint1, joint2, joint3, or all"),
        (["--trace-windows", "0.2"], "--trace-windows goes with --trace; add it"),
        (["--trace", "all", "--trace-windows", "-1"], "--trace-windows is -1.0 s; give a length from a step"),
        (["--trace", "all", "--trace-restart", "99"], "which is not within the motion, from 0 to"),
        (["--trace", "all", "--trace-restart", "soon"], "--trace-restart soon: give a time in s, or phases"),
        (["--trace", "all", "--trace-restart", "phases"], "there are none; give some with --phase"),
        (["--trace-torque", "motor=joint1"], "--trace-torque goes with --trace; add it"),
        (["--trace", "all", "--trace-torque", "motor"], "--trace-torque motor: write it as COLUMN=JOINT"),
        (
            ["--trace", "all", "--trace-torque", "motor=joint1"],
            "log.csv: --trace-torque motor=joint1: there is no such column; there are 'joint",
        ),
        (["--trace", "all", "--trace-torque-factor", "2"], "--trace-torque-factor goes with --trace-torque"),
        (["--trace", "all", "--convention", "gradient"], "--trace goes with --convention closing"),
        (
            ["--trace", "all", "--trace-restart", "phases", "--phase", "late=50..60"],
            "--trace-restart phases: no sample is in the phase late",
        ),
    ],
)
def test_what_cannot_be_traced_is_told_in_one_line(flags: list[str], told: str, tmp_path: Path) -> None:
    robot, system = package("planar3", tmp_path)
    names = [coordinate.name for coordinate in system.coordinates]
    given = [str(log(tmp_path, names)), "--robot", str(robot), "--out", str(tmp_path / "out"), "--no-page"]
    with pytest.raises(LinkwiseError, match=told):
        CliRunner().invoke(app, [*given, *flags], catch_exceptions=False)
    assert not (tmp_path / "out").exists()
