"""`model.simulate`: closed solutions, order, energy, loads, controllers, gradients, messages."""

import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import relative_error
from helpers.urdf_text import joint, link, robot
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

torch = pytest.importorskip("torch")
integrate = pytest.importorskip("scipy.integrate")

Packages = Callable[[str], ModuleType]
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
CRANE = f"{DATA / 'crane.urdf'} loops"
ROD = """schema = 1
name = "rod"
gravity = [0, -9.81, 0]
joint = [{name = "pin", type = "revolute", parent = "base", child = "rod"}]
link = [
  {name = "base"},
  {name = "rod", mass = 2.0, com = [0.3, 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
]
"""


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    folder = tmp_path_factory.mktemp("rod")
    (folder / "rod.toml").write_text(ROD)
    write_package(generate(read_system(folder / "rod.toml"), ["numpy"]), folder / "rod")
    return import_package(folder / "rod")


def swing(time: Any, angle: float) -> Any:
    """Angle from hanging, let go at `angle`: sin(theta/2) = k sn(K - w t, k)."""
    from scipy.special import ellipj, ellipk

    rate, k = np.sqrt(2.0 * 9.81 * 0.3 / (0.05 + 2.0 * 0.3**2)), np.sin(angle / 2.0)
    sine = ellipj(ellipk(k * k) - rate * time, k * k)[0]
    return 2.0 * np.arcsin(k * sine)


def test_a_pendulum_swings_as_its_closed_solution(rod: ModuleType) -> None:
    time, angle = np.linspace(0.0, 3.0, 31), 2.4
    start = [angle - np.pi / 2.0], [0.0]
    expected = swing(time, angle)
    found = rod.load().simulate(*start, time, method="DOP853", rtol=1e-12, atol=1e-13)
    assert np.abs(found.q[:, 0] + np.pi / 2.0 - expected).max() <= 1e-9
    model, angle = rod.load(), 1.0
    ends = [model.simulate([angle - np.pi / 2.0], [0.0], [0.0, 1.0], step=h) for h in (0.02, 0.01, 0.005)]
    errors = [abs(end.q[-1, 0] + np.pi / 2.0 - swing(1.0, angle)) for end in ends]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 4.0) < 0.05), orders


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_energy_changes_is_work(backend: str, package_of: Packages) -> None:
    package = package_of(CRANE)
    model = package.load(backend)
    q, qd, tau = np.random.default_rng(6).uniform(-1.0, 1.0, (3, 2, model.n))
    load = package.AppliedLoad(model.link_names[-1], [5.0, -4.0, 8.0], [0.5, 0.1, 0.2], [0.1, 0.0, 0.2])

    def controller(t: float, q: Any, qd: Any) -> Any:
        return float(np.sin(3.0 * t)) - 2.0 * qd

    for given in (tau, controller):
        drifts = []
        for step in (0.04, 0.02):
            found = model.simulate(q, qd, [0.0, 0.04, 0.08], given, [load], step=step)
            assert [tuple(a.shape) for a in found] == [
                *((3,), (3, 2, model.n), (3, 2, model.n), (3, 2, model.n), (3, 2), (3, 2))
            ]
            drifts.append(float(abs(found.energy_drift).max()))
        change = float(abs(found.energy[-1] - found.energy[0]).max())
        assert drifts[1] <= 1e-4 * change, drifts
        assert drifts[1] <= drifts[0] / 8.0, drifts


HAND = robot(
    *map(link, "abc"),
    joint("ab", "a", "b", inner='<dynamics damping="0.5" friction="0"/>'),
    joint("bc", "b", "c", inner='<dynamics damping="0.1" friction="0.2"/>'),
    """<gazebo reference="bc"><springStiffness>4</springStiffness>
    <springReference>0.1</springReference></gazebo>
    <transmission xmlns:drake="http://drake.mit.edu"><joint name="bc"/><actuator>
    <drake:rotor_inertia value="1e-4"/><drake:gear_ratio value="50"/></actuator></transmission>""",
)


@pytest.mark.parametrize("own", ["with armature", "without"])
def test_springs_and_gears_store_what_losses_do_not_take(own: str, tmp_path: Path) -> None:
    text = HAND if own == "with armature" else HAND.replace("1e-4", "0")
    (tmp_path / "hand.urdf").write_text(text)
    write_package(generate(read_system(tmp_path / "hand.urdf"), ["numpy"]), tmp_path / "hand")
    hand = import_package(tmp_path / "hand").load()
    q, qd, tau = np.array([[0.3, 0.2], [0.5, 3.0], [0.4, 1.0]])
    found = hand.simulate(q, qd, [0.0, 0.04, 0.08], tau, method="DOP853")
    assert np.all(found.qd[:, 1] > 0.0), "friction has one sign"
    assert np.abs(found.energy_drift).max() <= 1e-8
    free = hand.simulate(q, qd, [0.0, 0.04, 0.08], tau, method="DOP853", passive=False)
    assert relative_error(found.q, free.q) > 1e-3

    def rates(t: float, state: Any) -> Any:
        return np.concatenate([state[2:], hand.forward_dynamics(state[:2], state[2:], tau, passive=True)])

    start = np.concatenate([q, qd])
    own_way = integrate.solve_ivp(rates, (0.0, 0.08), start, "RK45", rtol=1e-10, atol=1e-12)
    assert relative_error(found.q[-1], own_way.y[:2, -1]) <= 1e-8


def test_the_energy_of_moving_bases_is_what_their_velocities_leave(package_of: Packages) -> None:
    model = package_of(str(DATA / "turntable.py")).load("numpy")
    q, qd = np.random.default_rng(2).uniform(-1.0, 1.0, (2, model.n))
    found = model.simulate(q, qd, np.linspace(0.0, 1.0, 5), method="DOP853")
    assert np.abs(found.energy_drift).max() <= 1e-7 * np.abs(found.energy).max()


def test_steps_of_all_kinds_lead_to_one_place(package_of: Packages) -> None:
    model = package_of(CRANE).load("numpy")
    q, qd, tau = np.random.default_rng(7).uniform(-1.0, 1.0, (3, 4, model.n))
    time = np.array([0.5, 0.65, 0.7])
    found = [
        model.simulate(q, qd, time, tau, passive=False, **how)
        for how in ({"step": 2e-3}, {"method": "RK45"}, {"method": "Radau", "rtol": 1e-7})
    ]

    def rates(t: float, state: Any) -> Any:
        a, b = state.reshape(2, 4, model.n)
        return np.stack([b, model.forward_dynamics(a, b, tau)]).ravel()

    own = integrate.solve_ivp(
        rates, (0.5, 0.7), np.stack([q, qd]).ravel(), "LSODA", t_eval=time, rtol=1e-11, atol=1e-12
    )
    expected = own.y.T.reshape(3, 2, 4, model.n)
    for one, bound in zip(found, (1e-7, 1e-7, 1e-5), strict=True):
        np.testing.assert_array_equal(one.time, time)
        assert relative_error(one.q, expected[:, 0]) <= bound
        assert relative_error(one.qd, expected[:, 1]) <= bound


def test_no_step_is_longer_than_asked_and_torques_are_those_of_its_instants(rod: ModuleType) -> None:
    """Under a torque that grows with time's square Runge and Kutta's steps, and Simpson's rule, are exact."""
    model, time, step = rod.load(), np.array([0.5, 0.55, 0.85, 0.86]), 0.02
    inertia, asked = 0.05 + 2.0 * 0.3**2, []

    def torque(t: float, q: Any, qd: Any) -> Any:
        asked.append(t)
        return model.inverse_dynamics(q, 0.0 * qd, 0.0 * qd) + inertia * (1.0 - 2.0 * t + 3.0 * t * t)

    def motion(t: Any) -> Any:
        return t**2 / 2.0 - t**3 / 3.0 + t**4 / 4.0, t - t**2 + t**3

    start = motion(0.5)
    found = model.simulate([start[0]], [start[1]], time, torque, step=step)
    assert np.abs(found.q[:, 0] - motion(time)[0]).max() <= 1e-12
    assert np.abs(found.qd[:, 0] - motion(time)[1]).max() <= 1e-12
    instants = np.unique(np.round(asked, 9))
    middles = [m for a, b in pairwise(time) for m in middles_of(a, b, step)]
    ends = [e for a, b in pairwise(time) for e in np.linspace(a, b, 1 + len(middles_of(a, b, step)))]
    np.testing.assert_allclose(instants, np.unique(np.round([*ends, *middles], 9)), atol=1e-9)
    asked.clear()
    model.simulate([start[0]], [start[1]], time, torque, step=step, method="RK45")
    assert np.diff(np.unique(asked)).max() <= step


def middles_of(begin: float, end: float, step: float) -> Any:
    """Return the middles of the fewest equal steps that are none longer than asked."""
    count = next(n for n in range(1, 100) if (end - begin) / n <= step + 1e-12)
    return begin + (np.arange(count) + 0.5) * (end - begin) / count


def test_a_solvers_motion_has_the_dtype_of_its_start(rod: ModuleType) -> None:
    start = np.zeros(1, np.float32)
    for how in ({}, {"method": "RK45"}):
        found = rod.load().simulate(start, start, [0.0, 0.1], **how)
        assert {str(a.dtype) for a in found} == {"float32"}


def test_gradients_flow_through_the_steps(package_of: Packages) -> None:
    model = package_of(CRANE).load("torch")
    q, qd, tau = torch.from_numpy(np.random.default_rng(8).uniform(-1, 1, (3, model.n)))

    def end(*given: Any) -> Any:
        return model.simulate(*given[:2], [0.0, 0.03], given[2]).q[-1]

    assert torch.autograd.gradcheck(end, tuple(a.requires_grad_() for a in (q, qd, tau)), fast_mode=True)
    with pytest.raises(TypeError, match=r"^method 'RK45' computes with arrays and keeps no gradient"):
        model.simulate(q, qd, [0.0, 0.1], method="RK45")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time": [0.0, 0.0]}, r"^time\[0\] is 0; instants must be finite, each later than the one before$"),
        ({"time": 1.0}, r"^time has shape \(\) and dtype float64; give the instants in s"),
        ({"step": 0}, r"^step is 0; give a number above 0$"),
        ({"method": "Euler"}, r"^method is 'Euler'; choose RK4 or, of SciPy, RK23, RK45"),
        ({"method": "RK45", "rtol": -1.0}, r"^rtol is -1.0; give a number above 0$"),
        ({"tau": [0.0]}, r"^tau has shape \(1,\); its last axis must be 3"),
        (
            {"tau": lambda t, q, qd: np.zeros((2, 3))},
            r"^tau: \(2,\) samples are more than the \(\) of q and qd; give these as many from",
        ),
        ({"q": [0.0, np.nan, 0.0]}, r"^q is nan for joint"),
        ({"tau": [1e200, 0, 0], "time": [0, 1.0, 2.0]}, r"^the motion is not finite at t = 1 s"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_wrong_with_a_simulation_is_named(
    given: dict[str, Any], message: str, package_of: Packages
) -> None:
    model = package_of(CRANE).load("numpy")
    with pytest.raises(ValueError, match=message):
        model.simulate(**({"q": np.zeros(3), "qd": np.zeros(3), "time": [0.0, 0.1]} | given))


def test_without_scipy_fixed_steps_remain(rod: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.integrate", None)
    model = rod.load()
    assert model.simulate([0.0], [0.0], [0.0, 0.1]).q.shape == (2, 1)
    with pytest.raises(
        ImportError, match=r"^method 'RK45' is SciPy's, which is not installed here: pip inst"
    ):
        model.simulate([0.0], [0.0], [0.0, 0.1], method="RK45")
