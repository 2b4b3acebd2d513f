"""Net torques by cause are Pinocchio's, sum to joint torques, and are told where they are asked for."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pinocchio")

import pinocchio as pin
from helpers.motion_logs import LEG, PUMA560, smooth, write_csv
from helpers.urdf_text import chain, joint
from linkwise import Contact, LinkwiseError, Load, generate, read_system, write_package
from linkwise.analysis import Processing, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise_runtime.dynamics import Dynamics
from numpy.typing import NDArray

NAMES = ("shoulder", "gravity", "wrist")
"""A joint is called as a cause is."""
SPRUNG = '<dynamics damping="0.7" friction="0"/>'
CAUSES = ("gravity", "load:push", "damping", "shoulder", "motion:gravity", "wrist")
PUSH = np.array([1.0, -2.0, 3.0])
LEGS = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm, its package and a log."""
    made = tmp_path_factory.mktemp("arm")
    axes = ("0 0.6 0.8", "1 0 0", "0 0 1")
    joints = (
        joint(name, "abcd"[k], "abcd"[k + 1], axis=axes[k], inner=SPRUNG if k == 1 else "")
        for k, name in enumerate(NAMES)
    )
    (made / "arm.urdf").write_text(chain(*joints))
    write_package(generate(read_system(made / "arm.urdf"), ["numpy", "native"]), made / "arm")
    write_csv(made / "log.csv", smooth(60, 3), NAMES)
    return made


def of_pinocchio(model: Any, q: Any, qd: Any, qdd: Any) -> NDArray[np.float64]:
    """Torques (n, 1 + n) by gravity and by each coordinate's motion, of one instant.

    Torques by velocity alone are of second degree, so that each coordinate's part is half the slope times it.
    """
    data = model.createData()
    still = model.copy()
    still.gravity = pin.Motion.Zero()
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T - np.diag(model.armature)
    pin.computeRNEADerivatives(still, still.createData(), q, qd, np.zeros(len(q)))
    found = still.createData()
    pin.computeRNEADerivatives(still, found, q, qd, np.zeros(len(q)))
    motion = mass * qdd + 0.5 * found.dtau_dv * qd
    return np.column_stack([pin.computeGeneralizedGravity(model, data, q), motion])


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_net_torques_are_pinocchios_and_sum_to_joint_torques(backend: str, arm: Path) -> None:
    model = pin.buildModelFromUrdf(str(arm / "arm.urdf"))
    robot = load_robot(arm / "arm", backend)
    result = analyze(arm / "log.csv", robot, columns=["by-cause"], loads=[Load("push", "d", tuple(PUSH))])
    assert not any(name.count("/") > 2 for name in result.table)
    each = zip(result.q, result.qd, result.qdd, strict=True)
    expected = np.array([of_pinocchio(model, *motion) for motion in each])
    scale = np.abs(expected).max()
    for i, name in enumerate(NAMES):
        own = {cause: result.table.get(f"tau_by/{name}/{cause}", np.zeros(60)) for cause in CAUSES}
        for at, cause in enumerate(("gravity", "shoulder", "motion:gravity", "wrist")):
            np.testing.assert_allclose(own[cause], expected[:, i, at], rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(sum(own.values()), result.torque[:, i], rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(result["tau_by/gravity/damping"], 0.7 * result.qd[:, 1], rtol=1e-12)
    assert result.closure.nets_relative is not None
    assert 0 < result.closure.nets_relative < 1e-13
    assert result.record()["closure_is_of"].endswith("net torques by cause of every sample")
    named = result.to_xarray().torque_by
    assert tuple(named.by.values) == CAUSES
    np.testing.assert_array_equal(named.sel(joint="wrist", by="load:push"), result["tau_by/wrist/load:push"])


def test_one_net_torque_alone_may_be_asked_for(arm: Path) -> None:
    one = "tau_by/shoulder/gravity"
    alone, beside = (
        analyze(arm / "log.csv", arm / "arm", columns=asked) for asked in ([one], ["tau_gravity/**", one])
    )
    for found in (alone, beside):
        assert [name for name in found.table if name.startswith("tau_by/")] == [one]


@pytest.mark.parametrize("convention", ["closing", "gradient"])
@pytest.mark.parametrize("contacts", [(), (Contact("foot", "held", (0.1, -0.06, 0.0), name="sole"),)])
def test_tied_and_standing_robots_sum_up_as_their_columns_do(
    convention: Any, contacts: Any, tmp_path: Path
) -> None:
    coupled = '[[constraint]]\nname = "gear"\ntype = "coupling"\n'
    coupled += "terms = { ankle_angle_r = 1, knee_angle_r = [0.1, 0.5, 0.2] }\n"
    (tmp_path / "leg.toml").write_text(LEG.read_text() + coupled)
    write_package(generate(read_system(tmp_path / "leg.toml"), ["numpy"]), tmp_path / "leg")
    moving = smooth(80, 6)[:, :-1]
    moving[:, 1:] *= 0.4
    log = write_csv(tmp_path / "log.csv", moving, LEGS[:-1])
    how: dict[str, Any] = {"contacts": contacts}
    how["processing"] = Processing(edges="trim", convention=convention)
    whole = analyze(log, tmp_path / "leg", columns=["all", "tau_by/**"], **how)
    alone = analyze(log, tmp_path / "leg", columns=["tau_by/**"], **how)
    assert whole.record()["closure_is_of"] == "every sample"
    names = [name for name in alone.table if name.startswith("tau_by/")]
    assert names == [name for name in whole.table if name.startswith("tau_by/")]
    for name in names:
        _, joint_name, cause = name.split("/")
        kinds = ("tau_gravity/",) if cause == "gravity" else ("tau_qdd/", "tau_qd/")
        end = "" if cause == "gravity" else f"/{cause}"
        parts = [
            values
            for column, values in whole.table.items()
            if column.startswith(tuple(f"{kind}{joint_name}/" for kind in kinds)) and column.endswith(end)
        ]
        scale = max(1.0, float(np.abs(whole[f"tau/{joint_name}"]).max()))
        np.testing.assert_allclose(alone[name], np.sum(parts, axis=0), rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(whole[name], alone[name], rtol=0, atol=1e-11 * scale)


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_deviations_of_net_torques_are_those_of_sums_not_sums_of_deviations(backend: str, arm: Path) -> None:
    (arm / "bodies.toml").write_text('schema = 1\n[all]\nmass = "10 %"\n')
    model = pin.buildModelFromUrdf(str(arm / "arm.urdf"))
    robot = load_robot(arm / "arm", backend)
    asked = [
        "tau_by/shoulder/*",
        "sd/tau_by/shoulder/*",
        "tau_gravity/shoulder/*",
        "sd/tau_gravity/shoulder/*",
    ]
    result = analyze(arm / "log.csv", robot, columns=asked, uncertain=arm / "bodies.toml")
    at = 20
    motion = result.q[at], result.qd[at], result.qdd[at]
    plain, variance = of_pinocchio(model, *motion)[0], np.zeros(4)
    for j in range(1, 4):  # a link errs alone; torques are linear in its mass
        heavier = model.copy()
        parameters = 1.1 * model.inertias[j].toDynamicParameters()
        heavier.inertias[j] = pin.Inertia.FromDynamicParameters(parameters)
        variance += (of_pinocchio(heavier, *motion)[0] - plain) ** 2
    found = [result[f"sd/tau_by/shoulder/{cause}"][at] for cause in ("gravity", *CAUSES[3:])]
    np.testing.assert_allclose(found, np.sqrt(variance), rtol=1e-6)


def test_a_pattern_computes_what_it_names_alone(arm: Path) -> None:
    result = analyze(arm / "log.csv", arm / "arm", columns=["tau_by/wrist/shoulder"])
    told = [name for name in result.table if not name.startswith(("time", "q"))]
    assert told == ["tau/wrist", "tau_by/wrist/shoulder"]
    assert not any(name.startswith("tau_by") for name in analyze(arm / "log.csv", arm / "arm").table)
    with pytest.raises(LinkwiseError, match=r"made of \(tau_by\); it is there with columns 'by-cause'"):
        result.dense("tau_by")


def test_a_wrong_net_torque_of_one_sample_is_refused_wherever_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(40, 6), [f"joint{i}" for i in range(1, 7)])
    robot = load_robot(PUMA560, "numpy")
    own = Dynamics.packed

    def wrong(self: Any, *motion: Any) -> Any:
        found = own(self, *motion)
        gravity = found.gravity.copy()
        gravity[33:34] += 1e-6  # those that are computed once more are few and do not reach there
        return found._replace(gravity=gravity)

    monkeypatch.setattr(Dynamics, "packed", wrong)
    with pytest.raises(LinkwiseError, match="torques do not close"):
        analyze(log, robot, columns=["by-cause"])
