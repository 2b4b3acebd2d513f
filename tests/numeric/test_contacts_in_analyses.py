"""Reactions at contacts, found from a motion, against Pinocchio's torques and Jacobians of frames."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from helpers.motion_logs import smooth, write_csv
from linkwise import LinkwiseError, Load, Options, generate, read_system, write_package
from linkwise.analysis import Contacts, WhileColumn, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise_runtime.quantities import Contact
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

LIMIT = 1e-9
FEET = (
    Contact("FL_FOOT", "held", name="front"),
    Contact("FR_FOOT", "point", (0.01, 0.02, -0.01)),
    Contact("HL_FOOT", "hinged", axis=(0.3, 1.0, -0.2)),
    Contact("HR_FOOT", "rolling", normal=(0.1, 0.0, 1.0), radius=0.02),
)


@pytest.fixture(scope="module")
def solo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PinocchioModel]:
    """A quadruped on a floating base, and a log of it that has a column of when its first foot stands."""
    path = next(ROBOTS.rglob("solo12.urdf"), None) if ROBOTS.is_dir() else None
    if path is None:
        pytest.skip("needs real robots: pip install example-robot-data")
    folder = tmp_path_factory.mktemp("solo")
    system = read_system(path, Options(base="floating"))
    write_package(generate(system, ["numpy"], kernel="loops"), folder / "robot")
    names = [coordinate.name for coordinate in system.coordinates]
    table = smooth(60, len(names))
    table[:, 1:] *= 0.3
    stands = (table[:, 0] > 0.2).astype(float)
    write_csv(folder / "log.csv", np.column_stack([table, stands]), [*names, "stands"])
    return folder, PinocchioModel(path, system, floating=True)


def rows_of(own: PinocchioModel, contact: Contact, q: Any) -> Any:
    """A (rows, n) of a contact in linkwise's coordinates."""
    model, data = own.model, own.data
    state = own._state(q, 0.0 * q, 0.0 * q)[0]
    frame = model.getFrameId(contact.frame)
    pin.computeJointJacobians(model, data, state)
    pin.updateFramePlacements(model, data)
    both = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED) @ own.tie
    pose = data.oMf[frame]
    shift = both[:3] - pin.skew(pose.rotation @ np.array(contact.point)) @ both[3:]
    turn = both[3:]
    if contact.kind == "hinged":
        axis = pose.rotation @ np.array(contact.axis)
        across = np.linalg.svd(axis[None])[2][1:]
        return np.concatenate([across @ turn, shift])
    if contact.kind == "rolling":
        normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
        return shift + pin.skew(contact.radius * normal) @ turn
    return np.concatenate([turn, shift]) if contact.kind == "held" else shift


@pytest.mark.parametrize("pushes", [None, (8.0, 3.0, 5.0, 1.0)], ids=["alike", "as measured"])
def test_contacts_bear_what_the_base_asks_by_the_least_forces(
    solo: tuple[Path, PinocchioModel], pushes: tuple[float, ...] | None
) -> None:
    folder, own = solo
    loads = (
        ()
        if pushes is None
        else tuple(Load(c.frame, c.frame, (0.0, 0.0, push)) for c, push in zip(FEET, pushes, strict=True))
    )
    contacts = Contacts(FEET, {"front": WhileColumn("stands")}, loads, threshold=0.5 if loads else None)
    result = analyze(folder / "log.csv", folder / "robot", contacts=contacts)
    scale = np.abs(result.torque).max()
    for s in (0, 30, 59):
        q, motion = result.q[s], (result.q[s], result.qd[s], result.qdd[s])
        feet = FEET[int(result.time[s] < 0.2) :]
        parts = [rows_of(own, contact, q) for contact in feet]
        rows = np.concatenate(parts)
        roots = np.sqrt(np.repeat((pushes or np.ones(4))[-len(feet) :], list(map(len, parts))))
        for j, link in enumerate(result.robot.links):
            torque = own.torque(*motion, link)
            forces = roots * np.linalg.lstsq((rows * roots[:, None])[:, :6].T, torque[:6], rcond=None)[0]
            left = torque - rows.T @ forces
            assert np.abs(result.partial_torque[s, :, j] - left).max() <= LIMIT * scale
        borne = own.torque(*motion)
        for c, contact in enumerate(FEET):  # wrenches of every kind, about the contact's point
            borne = borne - rows_of(own, contact._replace(kind="held"), q).T @ result.contact_wrench[s, c]
        assert np.abs(result.torque[s] - borne).max() <= LIMIT * scale
        assert not result.torque[s, :6].any()  # the base gives nothing, to the last digit
        assert len(feet) == 4 or not result.contact_wrench[s, 0].any()


def test_each_source_moves_a_robot_that_stands_as_one_system_of_equations_says(
    solo: tuple[Path, PinocchioModel],
) -> None:
    """[M −Aᵀ; A 0] [q̈_x; λ_x] = [F_x; b_x], b that of contacts alone; shares sum to a measured motion."""
    folder, own = solo
    feet = FEET[:2]
    push = Load("push", "base_link", (3.0, -2.0, 5.0))
    contacts = Contacts(feet, {"front": WhileColumn("stands")})
    result = analyze(
        folder / "log.csv", folder / "robot", contacts=contacts, loads=[push], induced=["joints"]
    )
    for s in (0, 30, 59):
        q, qd, qdd = result.q[s], result.qd[s], result.qdd[s]
        on = feet[int(result.time[s] < 0.2) :]
        rows = np.concatenate([rows_of(own, contact, q) for contact in on])
        mass, n = own.mass(q), len(q)
        whole = np.block([[mass, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])

        def moved(force: Any, bend: Any, whole: Any = whole, n: int = n) -> Any:
            return np.linalg.lstsq(whole, np.concatenate([force, bend]), rcond=None)[0][:n]

        rest, still = np.zeros(n), np.zeros(len(rows))
        gravity = moved(-own.gravity(q), still)
        velocity = moved(own.gravity(q) - own.torque(q, qd, rest), still)
        slip = moved(rest, rows @ qdd)
        motors = qdd - gravity - velocity - slip
        names, found = result.robot.joints, {}
        for kind in ("acc", "acc_gravity", "acc_qd", "acc_contact", "acc_tau", "acc_load"):
            found[kind] = np.array(
                [
                    sum(
                        values[s]
                        for column, values in zip(result.columns, result.values, strict=True)
                        if column.quantity == kind and column.row == i
                    )
                    for i in range(len(names))
                ]
            )
        scale = max(np.abs(a).max() for a in found.values())
        expected = {"acc": qdd, "acc_gravity": gravity, "acc_qd": velocity, "acc_contact": slip}
        for kind, value in expected.items():
            assert np.abs(found[kind] - value).max() <= LIMIT * scale, kind
        assert np.abs(found["acc_tau"] + found["acc_load"] - motors).max() <= LIMIT * scale


def test_a_base_pitched_by_a_right_angle_is_refused_with_the_time(
    solo: tuple[Path, PinocchioModel], tmp_path: Path
) -> None:
    folder, _ = solo
    names = load_robot(folder / "robot").joints
    table = np.zeros((20, 1 + len(names)))
    table[:, 0] = np.arange(20) / 100
    table[:, 5] = np.linspace(1.2, np.pi / 2, 20)
    log = write_csv(tmp_path / "prone.csv", table, names)
    with pytest.raises(LinkwiseError, match=r"time 0\.19 s: two of base_x, .* turn about one axis"):
        analyze(log, folder / "robot", contacts=FEET[:1])
