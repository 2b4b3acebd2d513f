"""Deviations by noise of positions, by loads and by bodies, against draws through the whole chain.

Torques of arms are Pinocchio's.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, LOCKED_FINGERS, PANDA
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise import (
    Lowpass,
    Options,
    Processing,
    generate,
    read_system,
    write_package,
)
from linkwise.analysis import analyze
from linkwise.analysis.filtering import derivatives, lowpass
from linkwise.analysis.passed_noise import PassedNoise
from linkwise.package.load import import_package
from numpy.typing import NDArray

from numeric.drawn_bodies import DRAWS, agree
from numeric.draws import drawn_bodies, drawn_motions, passed

RATE, COUNT = 100.0, 160
LOWPASS = Lowpass(8.0)
MIDDLE = (60, 80, 101)
Floats = NDArray[np.float64]


def drawn_at(q: Floats, root: Floats, at: int) -> tuple[Floats, ...]:
    """Return q, qd and qdd (draws, n) at a sample, of positions (S, n) with noise of that covariance."""
    return drawn_motions(passed(len(q), at, RATE, LOWPASS.cutoff, LOWPASS.order), q, root, DRAWS)


@pytest.fixture(scope="module")
def panda(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of Panda's package and a log of it."""
    if not PANDA.is_file():
        pytest.skip("needs Panda: pip install example-robot-data")
    folder = tmp_path_factory.mktemp("panda")
    write_package(generate(read_system(str(PANDA), Options(lock=LOCKED_FINGERS))), folder / "panda")
    joints = import_package(folder / "panda").load("numpy").joint_names
    write_csv(folder / "log.csv", smooth(COUNT, len(joints)), joints)
    return folder


def test_torques_and_shares_of_panda_deviate_as_those_of_noisy_logs(panda: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    (panda / "noise.toml").write_text(
        'schema = 1\n[motion]\nangle = "0.2 deg"\n[motion.joint.panda_joint4]\nsd = "4 mrad"\n'
        '[motion.correlation]\njoints = ["panda_joint2", "panda_joint4"]\nmatrix = [[1, 0.7], [0.7, 1]]\n'
    )
    result = analyze(
        panda / "log.csv",
        panda / "panda",
        processing=Processing(lowpass=LOWPASS),
        uncertain=panda / "noise.toml",
    )
    sd = np.full(7, np.radians(0.2))
    sd[3] = 4e-3
    together = np.eye(7)
    together[1, 3] = together[3, 1] = 0.7
    root = np.linalg.cholesky(np.outer(sd, sd) * together)
    model = pin.buildReducedModel(
        pin.buildModelFromUrdf(str(PANDA)), [8, 9], pin.neutral(pin.buildModelFromUrdf(str(PANDA)))
    )
    data, shares = model.createData(), import_package(panda / "panda").load("numpy")
    raw = np.loadtxt(panda / "log.csv", delimiter=",", skiprows=1)[:, 1:]
    for at in MIDDLE:
        q, qd, qdd = drawn_at(raw, root, at)
        torque = np.array([pin.rnea(model, data, *motion) for motion in zip(q, qd, qdd, strict=True)])
        agree(result.dense("sd/tau")[at], torque.std(0))
        for name, drawn in zip(("q", "qd", "qdd"), (q, qd, qdd), strict=True):
            agree(result.dense(f"sd/{name}")[at], drawn.std(0))
        found = shares.propagation(q, qd, qdd)
        for name, drawn in zip(("tau_qdd", "tau_qd", "tau_gravity"), found, strict=True):
            agree(result.dense(f"sd/{name}")[at], drawn.std(0))
        agree(result.dense("sd/power")[at], (torque * qd).std(0))


@pytest.mark.parametrize(
    "how",
    [
        Processing(lowpass=LOWPASS),
        Processing(derivative="savitzky-golay"),
        Processing(),
        Processing(lowpass=Lowpass(20.0, 4, "even")),
    ],
)
@pytest.mark.parametrize("count", [45, 400])
def test_noise_behind_filter_and_derivatives_is_that_of_draws_ends_and_all(
    how: Processing, count: int
) -> None:
    pytest.importorskip("scipy.signal")
    raw = np.random.default_rng(0).normal(size=(count, 20_000))
    q = raw.copy()
    if how.lowpass is not None:
        lowpass(q, RATE, how.lowpass)
    motion = np.stack(derivatives(q, RATE, 0, count, how))
    passed = PassedNoise.of(count, RATE, how)
    told = passed.covariance(np.arange(count))
    drawn = np.einsum("atm,btm->tab", motion, motion) / raw.shape[1]
    sizes = np.sqrt(np.einsum("taa->ta", told))
    np.testing.assert_allclose(np.sqrt(np.einsum("taa->ta", drawn)), sizes, rtol=0.03)
    assert np.abs((drawn - told) / (sizes[:, :, None] * sizes[:, None])).max() < 0.05
    left = ((raw - motion[0]) ** 2).mean(1)
    np.testing.assert_allclose(passed.removed[passed.alike(np.arange(count))], left, rtol=0.05, atol=1e-12)


def test_noise_is_estimated_from_what_the_filter_took_away(panda: Path) -> None:
    raw = np.loadtxt(panda / "log.csv", delimiter=",", skiprows=1)[:, 1:]
    slow = np.repeat(raw[:1], 3000, 0) + 0.3 * np.sin(0.05 * np.arange(3000) / RATE * 2.0 * np.pi)[:, None]
    sd = 1e-3 * np.array([1.0, 0.3, 2.0, 0.5, 1.0, 1.0, 1.0])
    noise = np.random.default_rng(4).normal(size=slow.shape)
    noise[:, 1] = 0.8 * noise[:, 0] + 0.6 * noise[:, 1]
    joints = import_package(panda / "panda").load("numpy").joint_names
    write_csv(panda / "noisy.csv", np.column_stack([np.arange(3000) / RATE, slow + sd * noise]), joints)
    (panda / "estimate.toml").write_text("schema = 1\n[motion]\nestimate = true\n")
    for how in (Processing(lowpass=LOWPASS), Processing(derivative="savitzky-golay")):
        result = analyze(
            panda / "noisy.csv", panda / "panda", processing=how, uncertain=panda / "estimate.toml"
        )
        assert result.uncertain is not None
        told: dict[str, Any] = result.uncertain["motion"]
        np.testing.assert_allclose([one["sd"] for one in told["noise"]], sd, rtol=0.06)
        assert abs(told["correlation"][0][1] - 0.8) < 0.03
        assert abs(told["correlation"][2][3]) < 0.1
        said = "noise of positions, from what the filter took away: panda_joint1 "
        assert any(said in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("slowness", "told"), [(0.0, ""), (0.7, "what the filter took away of joint2 is not noise")]
)
def test_noise_that_goes_on_from_sample_to_sample_is_told(slowness: float, told: str, tmp_path: Path) -> None:
    signal = pytest.importorskip("scipy.signal")
    noise = 1e-3 * np.random.default_rng(3).normal(size=(3000, 3))
    noise[:, 1] = signal.lfilter([1.0], [1.0, -slowness], noise[:, 1])
    table = smooth(3000, 3)
    table[:, 1:] = 0.3 * np.sin(0.4 * table[:, 1:]) + noise
    write_csv(tmp_path / "log.csv", table)
    (tmp_path / "estimate.toml").write_text("schema = 1\n[motion]\nestimate = true\n")
    for how in (Processing(lowpass=LOWPASS), Processing(derivative="savitzky-golay")):
        result = analyze(tmp_path / "log.csv", PLANAR3, processing=how, uncertain=tmp_path / "estimate.toml")
        found = [warning for warning in result.warnings if "is not noise" in warning]
        assert len(found) == bool(told)
        assert all(told in one for one in found)


BOTH = 'schema = 1\n[motion]\nangle = "2 mrad"\nlength = "1 mm"\n[all]\nmass = "5 %"\ncentre = "4 mm"\n'


def test_reactions_and_induced_accelerations_deviate_as_those_of_draws(tmp_path: Path) -> None:
    robot = generate(read_system(str(DATA / "crane.urdf"), Options(base="floating")), ["numpy"], "crane")
    write_package(robot, tmp_path / "crane")
    package = import_package(tmp_path / "crane")
    model = package.load("numpy")
    table = smooth(COUNT, len(model.joint_names))
    write_csv(tmp_path / "log.csv", table, model.joint_names)
    (tmp_path / "both.toml").write_text(BOTH)
    tip = model.tree_joint_names[-1]
    result = analyze(
        tmp_path / "log.csv",
        tmp_path / "crane",
        processing=Processing(lowpass=LOWPASS, start=MIDDLE[0] / RATE, stop=MIDDLE[-1] / RATE),
        uncertain=tmp_path / "both.toml",
        reactions=[tip],
        induced=["boom"],
    )
    sd = np.array([2e-3 if unit == "rad" else 1e-3 for unit in model.joint_units])
    drawn = package.load("numpy", bodies=drawn_bodies(package, DRAWS, mass=0.05, centre=0.004))
    for at in (0, -1):
        motion = drawn_at(table[:, 1:], np.diag(sd), MIDDLE[at])
        found = drawn.reactions(*motion, joints=[tip])
        whole = (found.acceleration + found.velocity).sum((-2, -3))[:, 0] + found.gravity.sum(-2)[:, 0]
        agree(result.dense("sd/reaction")[at, 0], whole.std(0))
        agree(result.dense("sd/tau")[at], drawn.inverse_dynamics(*motion).std(0))
        agree(result.dense("sd/tau_link")[at], drawn.partial_torque(*motion).std(0))
    induced = drawn.induced_accelerations(*motion[:2], qdd=motion[2], frame="boom")
    agree(result.dense("sd/acc_tau")[-1, 0], induced.actuators.std(0))


def test_tied_joints_and_forces_of_ties_deviate_as_those_of_draws(tmp_path: Path) -> None:
    (tmp_path / "both.toml").write_text(BOTH)
    write_package(generate(read_system(DATA / "fourbar.toml"), ["numpy"], "fourbar"), tmp_path / "fourbar")
    package = import_package(tmp_path / "fourbar")
    model = package.load("numpy")
    free = model.constraints.independent
    table = smooth(COUNT, len(free))
    table[:, 1:] *= 0.3
    write_csv(tmp_path / "log.csv", table, free)
    how = Processing(lowpass=LOWPASS)
    result = analyze(
        tmp_path / "log.csv", tmp_path / "fourbar", processing=how, uncertain=tmp_path / "both.toml"
    )
    drawn = package.load("numpy", bodies=drawn_bodies(package, DRAWS, mass=0.05, centre=0.004)).constraints
    own = [model.joint_names.index(name) for name in free]
    for at in MIDDLE:
        moved = drawn_at(table[:, 1:], 2e-3 * np.eye(len(free)), at)
        start = np.broadcast_to(result.q[at], (DRAWS, len(model.joint_names))).copy()
        start[:, own] = moved[0]
        q = model.constraints.closed(start)
        qd = model.constraints.velocity(q, moved[1])
        qdd = model.constraints.acceleration(q, qd, moved[2])
        agree(result.dense("sd/tau")[at][own], drawn.inverse_dynamics(q, qd, qdd).std(0))
        agree(result.dense("sd/tau_link")[at][own], drawn.partial_torque(q, qd, qdd).std(0))
        agree(result.dense("sd/force_link")[at], np.swapaxes(drawn.forces(q, qd, qdd), 1, 2).std(0))
