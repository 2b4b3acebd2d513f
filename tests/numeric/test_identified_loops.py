"""Links of closed mechanisms identified from torques that Pinocchio's open tree and its ties ask for."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Fitting, LinkwiseError, Options, generate, identify, read_system, write_package
from linkwise.analysis.load_robot import load_robot
from linkwise.identification.identified_files import record
from linkwise.identification.identified_robot import identified_robot
from linkwise.identification.uncertain_robot import without
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest

pytest.importorskip("pinocchio")

import pinocchio as pin
from helpers.motion_logs import write_csv

from numeric.loops import MECHANISMS, LoopOracle, Mechanism

LIMIT = 1e-9
RATE = 300.0


class Driven:
    """A mechanism whose bodies are others than its package's, with friction in every joint."""

    def __init__(self, name: str, folder: Path, swing: float) -> None:
        mechanism = MECHANISMS[name]
        (folder / "robot.toml").write_text(mechanism.text)
        write_package(generate(read_system(folder / "robot.toml"), ["numpy"], kernel="loops"), folder / name)
        self.package, self.start, self.swing = folder / name, np.array(mechanism.q), swing
        self.robot = load_robot(self.package)
        assert self.robot.constrained is not None
        self.ties = self.robot.constrained.constraints
        self.own = list(self.robot.driven)
        self.rest = [k for k in range(len(self.start)) if k not in self.own]
        self.oracle = LoopOracle(other(mechanism), self.robot.joints)
        self.friction = np.random.default_rng(5).uniform(0.1, 0.5, (len(self.start), 2))

    def motion(self, samples: int, seed: int) -> tuple[Any, ...]:
        """Time, q, qd, qdd (S, n) and what the independent joints give, (S, m)."""
        draw, t, m = np.random.default_rng(seed), np.arange(samples) / RATE, len(self.own)
        w, phase = draw.uniform(0.7, 3.0, (m, 3)), draw.uniform(0.0, 6.0, (m, 3))
        size = self.swing * draw.uniform(0.3, 1.0, (m, 3))
        at = w * t[:, None, None] + phase
        y = self.start[self.own] + (size * np.sin(at)).sum(-1)
        yd, ydd = (size * w * np.cos(at)).sum(-1), -(size * w**2 * np.sin(at)).sum(-1)
        q, last = np.tile(self.start, (samples, 1)), self.start
        for at in range(0, samples, 50):
            some = slice(at, at + 50)
            q[some, self.rest], q[some, self.own] = last[self.rest], y[some]
            q[some] = self.ties.closed(q[some])
            last = q[some][-1]
        found = [self.needed(*sample) for sample in zip(q, yd, ydd, strict=True)]
        return (t, q, *(np.array(part) for part in zip(*found, strict=True)))

    def needed(self, q: Any, yd: Any, ydd: Any) -> tuple[Any, Any, Any]:
        """qd, qdd and torques, by Pinocchio's rows of A."""
        g = self.velocity_map(q)
        qd, gamma = g @ yd, self.oracle.rows(q, g @ yd)[1]
        qdd = g @ ydd
        qdd[self.rest] -= np.linalg.pinv(self.oracle.rows(q, qd)[0][:, self.rest]) @ gamma
        mass, bias = self.oracle.mass_and_bias(q, qd)
        rubbed = self.friction[:, 0] * qd + self.friction[:, 1] * np.sign(qd)
        return qd, qdd, g.T @ (mass @ qdd + bias + rubbed)

    def velocity_map(self, q: Any) -> Any:
        rows = self.oracle.rows(q, 0.0 * q)[0]
        g = np.zeros((len(q), len(self.own)))
        g[self.own] = np.eye(len(self.own))
        g[self.rest] = -np.linalg.pinv(rows[:, self.rest]) @ rows[:, self.own]
        return g

    def log(self, path: Path) -> Path:
        t, q, _, _, torque = self.motion(1500, 1)
        names = [*self.robot.joints, *(f"tau/{joint}" for joint in self.robot.driven_joints)]
        return write_csv(path, np.column_stack([t, q, torque]), names)

    def rank(self) -> int:
        """Return the rank of Pinocchio's regressor on the independent joints, in closed positions."""
        draw, model, rows = np.random.default_rng(6), self.oracle.model, []
        order = self.oracle.order
        carried = np.repeat([inertia.mass > 0.0 for inertia in model.inertias[1:]], 10)
        for q in self.ties.closed(self.start + draw.uniform(-0.15, 0.15, (80, len(self.start)))):
            g, data = self.velocity_map(q), model.createData()
            qd, qdd, _ = self.needed(q, *draw.uniform(-3.0, 3.0, (2, len(self.own))))
            regressor = pin.computeJointTorqueRegressor(model, data, q[order], qd[order], qdd[order])
            rows.append(g.T @ self.oracle._back(regressor[:, carried].T).T)
        whole = np.concatenate(rows)
        sizes = np.linalg.norm(whole, axis=0)
        shown = sizes > 1e-9 * sizes.max()
        values = np.linalg.svd(whole[:, shown] / sizes[shown], compute_uv=False)
        return int((values > 1e-9 * values[0]).sum())


def other(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with links that are some 30 % lighter or heavier, their centres elsewhere."""
    draw = np.random.default_rng(7)
    links = []
    for link in mechanism.robot.links:
        x, y, z = (float(c + draw.uniform(-0.03, 0.03)) for c in link.com)
        links.append(replace(link, mass=link.mass * float(draw.uniform(0.7, 1.4)), com=(x, y, z)))
    return replace(mechanism, robot=replace(mechanism.robot, links=tuple(links)))


@pytest.mark.parametrize(("name", "swing"), [("fourbar", 0.5), ("delta", 0.15)])
def test_links_of_a_closed_mechanism_are_found_and_predict_another_motion(
    name: str, swing: float, tmp_path: Path
) -> None:
    driven = Driven(name, tmp_path, swing)
    found = identify(driven.log(tmp_path / "log.csv"), driven.package)
    assert found.base.count == driven.rank()
    np.testing.assert_allclose(found.fit.friction, driven.friction[list(found.bearings.joints)], atol=1e-6)
    _, q, qd, qdd, torque = driven.motion(100, 2)
    y = driven.robot.model.regressor(q, qd, qdd)[:, driven.own].reshape(*torque.shape, -1)
    rubbed = found.bearings.columns(q, qd).reshape(*torque.shape, -1) @ found.fit.friction.reshape(-1)
    predicted = y[..., list(found.base.picked)] @ found.fit.beta + rubbed
    assert np.abs(predicted - torque).max() <= LIMIT * np.abs(torque).max()
    # The files are the same mechanism with these bodies.
    files, lost = identified_robot(found, Manifest.read(driven.package), None)
    assert set(files) == {f"{name}.urdf", f"{name}.toml"}
    assert all(words.startswith("a URDF file has no gravity") for words in lost)
    assert (
        without(found) == f"no uncertain.toml: joints of {name} are tied, whose shares have no deviations yet"
    )
    assert np.isfinite(np.asarray(found.uncertain_bodies.parameters)).all()
    assert record(found)["uncertain"] == without(found)
    for file, text in files.items():
        (tmp_path / file).write_bytes(text)
    given = Options(constraints=tmp_path / f"{name}.toml")
    write_package(generate(read_system(tmp_path / f"{name}.urdf", given), ["numpy"]), tmp_path / "again")
    again = import_package(tmp_path / "again").load("numpy")
    assert tuple(again.constraints.independent) == driven.robot.driven_joints
    # A URDF file has no gravity of its own: what the motion alone asks is compared.
    rest = 0.0 * qd
    still = driven.robot.model.regressor(q, rest, rest)[:, driven.own].reshape(y.shape)
    moved = (y - still) @ found.physical.pi.reshape(-1)
    answered = again.constraints.inverse_dynamics(q, qd, qdd) - again.constraints.inverse_dynamics(
        q, rest, rest
    )
    np.testing.assert_allclose(answered, moved, rtol=0, atol=1e-8 * np.abs(moved).max())


def test_friction_that_no_motion_tells_from_another_joints_counts_in_that(tmp_path: Path) -> None:
    """A joint of Bennett's linkage turns as fast as the one across from it."""
    driven = Driven("bennett", tmp_path, 0.3)
    found = identify(driven.log(tmp_path / "log.csv"), driven.package)
    assert driven.robot.driven_joints == ("one",)
    assert found.shared_friction == ("three",)
    np.testing.assert_allclose(found.fit.friction[0], driven.friction[[0, 2]].sum(0), atol=1e-6)
    np.testing.assert_allclose(found.fit.friction[1], driven.friction[1], atol=1e-6)


def test_a_torque_of_a_joint_that_follows_is_refused(tmp_path: Path) -> None:
    driven = Driven("fourbar", tmp_path, 0.5)
    log = driven.log(tmp_path / "log.csv")
    follower = driven.robot.joints[driven.rest[0]]
    with pytest.raises(
        LinkwiseError, match=f"^{follower} follows '{driven.robot.driven_joints[0]}' and gives no"
    ):
        identify(log, driven.package, fitting=Fitting(unmeasured=(follower,)))
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    names = [*driven.robot.joints, f"tau/{driven.robot.driven_joints[0]}", f"tau/{follower}"]
    both = write_csv(tmp_path / "both.csv", np.column_stack([table, table[:, -1]]), names)
    with pytest.raises(
        LinkwiseError, match=f"column 'tau/{follower}' is a torque of {follower}, which follows"
    ):
        identify(both, driven.package)
