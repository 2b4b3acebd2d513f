"""Analyses of closed mechanisms in space against Pinocchio's open tree and one system of equations."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Load, analyze, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

from helpers.motion_logs import write_csv

from numeric.loops import MECHANISMS, LoopOracle

LIMIT = 1e-9
FORCE = (3.0, -2.0, 5.0)


def moving(name: str, folder: Path, samples: int = 40) -> tuple[Any, LoopOracle, Path]:
    """A mechanism's package, its oracle, and a log of all joints of a motion in which loops stay closed."""
    mechanism = MECHANISMS[name]
    (folder / "robot.toml").write_text(mechanism.text)
    write_package(generate(read_system(folder / "robot.toml"), ["numpy"], kernel="loops"), folder / name)
    module = import_package(folder / name)
    robot = module.load("numpy")
    time = np.arange(samples) / 100
    swing = 0.02 * np.sin(np.outer(time, 5.0 + 1.7 * np.arange(robot.n)) + np.arange(robot.n))
    q = robot.constraints.closed(np.array(mechanism.q) + swing)
    log = write_csv(folder / "log.csv", np.column_stack([time, q]), robot.joint_names)
    return module, LoopOracle(mechanism, robot.joint_names), log


@pytest.mark.parametrize("name", ["bennett", "delta", "held_arm"])
def test_every_source_alone_accelerates_a_closed_chain_as_one_system_of_equations_says(
    name: str, tmp_path: Path
) -> None:
    module, oracle, log = moving(name, tmp_path)
    robot = module.load("numpy")
    hand, body = robot.link_names[-1], (0.02, 0.03, 0.05)
    points = ["joints", ",".join(map(str, (hand, *body)))]
    load = Load("pull", hand, force=FORCE, point=body)
    found = analyze(log, tmp_path / name, loads=[load], induced=points)
    assert found.closure.induced_relative is not None
    assert found.closure.induced_relative <= 1e-12
    shown: dict[tuple[Any, ...], Any] = {}
    for column, values in zip(found.columns, found.values, strict=True):
        if column.point is not None:
            key = column.point, column.quantity, column.link, column.row
            shown[key] = shown.get(key, 0.0) + values
    own = [robot.joint_index(joint) for joint in robot.constraints.independent]
    for s in (0, 17, 39):
        q, qd = found.q[s], found.qd[s]
        (mass, _), (rows, rate) = oracle.mass_and_bias(q, qd), oracle.rows(q, qd)
        place, turned = robot.kinematics.jacobian(q, hand, body), found.torque[s]
        rest = 0.0 * q
        forces: dict[tuple[str, int | None], Any] = {("acc_tau", None): turned * np.isin(range(robot.n), own)}
        for j, link in enumerate(robot.link_names):
            weight = oracle.torque(link, q, rest, rest)
            forces["acc_gravity", j] = -weight
            forces["acc_qd", j] = weight - oracle.torque(link, q, qd, rest)
        forces["acc_load", None] = place[3:].T @ np.array(FORCE)
        forces["acc_constraint", None] = rest
        for (quantity, j), force in forces.items():
            size = len(rows)
            whole = np.block([[mass, -rows.T], [rows, np.zeros((size, size))]])
            moved = -rate if quantity == "acc_constraint" else 0.0 * rate
            expected = np.linalg.lstsq(whole, np.concatenate([force, moved]), rcond=1e-12)[0][: robot.n]
            for point, jacobian in ((0, np.eye(robot.n)), (1, place)):
                values = [shown[point, quantity, j, r][s] for r in range(len(jacobian))]
                scale = np.abs(jacobian @ found.qdd[s]).max()
                np.testing.assert_allclose(values, jacobian @ expected, rtol=0, atol=LIMIT * scale)


@pytest.mark.parametrize("name", ["fourbar", "held_arm"])
def test_columns_of_a_closed_chain_are_the_shares_of_its_package(name: str, tmp_path: Path) -> None:
    module, _, log = moving(name, tmp_path)
    robot = module.load("numpy")
    body = robot.link_names[1]
    pull = [module.AppliedLoad(body, FORCE)]
    found = analyze(log, tmp_path / name, loads=[Load("pull", body, force=FORCE)], induced=[body])
    shares = robot.induced_accelerations(found.q, found.qd, qdd=found.qdd, loads=pull, frame=body)
    seen = set()
    for column, values in zip(found.columns, found.values, strict=True):
        if column.point is None:
            continue
        alike = {
            "acc": shares.total[:, column.row],
            "acc_tau": shares.actuators[:, column.row, column.cause],
            "acc_gravity": shares.gravity[:, column.row, column.link],
            "acc_load": shares.loads[:, column.row, 0],
            "acc_constraint": shares.constraints[:, column.row, column.cause],
            "acc_kinematic": shares.kinematic[:, column.row, column.cause],
            "acc_qd": shares.velocity[:, column.row, column.link, column.cause],
        }[column.quantity]
        scale = np.abs(shares.total[:, column.row]).max() + 1e-3
        np.testing.assert_allclose(values, alike, rtol=0, atol=LIMIT * scale, err_msg=column.name)
        seen |= {column.quantity} if np.abs(alike).max() > 0.0 else set()
    assert len(seen) == 7, "every kind of share is there"
