"""`simulate` by the compiled C: as the equations in NumPy, each motion by itself, controllers, errors."""

import ctypes
import gc
import signal
import subprocess
import sys
import weakref
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import relative_error
from helpers.urdf_text import chain, joint
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.motion.c_controller import CONTROLLER
from linkwise_runtime.motion.equations_of_motion import EquationsOfMotion

from runtime.test_simulation import HAND

pytestmark = needs_compiler
CRANE, CRANK = f"{DATA / 'crane.urdf'} loops", str(DATA / "crank_rocker.toml")
FOURBAR = str(DATA / "fourbar.toml")
TIME = np.linspace(0.1, 0.14, 5)
WORDS = ("q", "qd", "tau", "energy", "work")
HOLD = """#include <stddef.h>
int hold(void *context, double time, size_t count, const {real} *q, const {real} *qd, {real} *tau)
{{
    const {real} *gain = context;
    for (size_t e = 0; e < count * {n}; ++e)
        tau[e] = gain ? -gain[0] * q[e] - gain[1] * qd[e] : ({real})time;
    return time > 0.12 && !gain ? -7 : 0;
}}
"""


def pull(t: float, q: Any, qd: Any) -> Any:
    """Torques of a controller of Python."""
    return 1e-2 * np.sin(20.0 * t) - 1e-3 * qd - 1e-3 * q


@pytest.fixture(scope="module")
def made(package_of: Callable[[str], ModuleType], tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Packages by name, and a start of three motions of each."""
    folder = tmp_path_factory.mktemp("hand")
    (folder / "hand.urdf").write_text(HAND)

    @cache
    def package(name: str) -> ModuleType:
        if name == "hand":
            write_package(generate(read_system(folder / "hand.urdf"), ["numpy", "native"]), folder / "hand")
            return import_package(folder / "hand")
        return package_of({"crane": CRANE, "standing": CRANE, "four-bar": FOURBAR, "puma": "puma560"}[name])

    def start(name: str, backend: str) -> tuple[Any, Any, Any, dict[str, Any]]:
        module = package(name)
        robot, rng, how = module.load(backend), np.random.default_rng(5), dict[str, Any]()
        if name == "four-bar":
            q = robot.constraints.closed(rng.uniform(-0.3, 0.3, (3, robot.n)))
            return robot, q, robot.constraints.velocity(q, rng.uniform(-1.0, 1.0, (3, 1))), how
        q, qd = rng.uniform(-0.5, 0.5, (2, 3, robot.n))
        if name == "standing":
            held = [module.Contact(robot.link_names[-1], "point", (0.1, 0.0, 0.2))]
            how["constraints"] = robot.constrained(contacts=held, at=q[0])
        return robot, q, qd, how

    return start


@pytest.fixture
def no_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the equations in arrays fail, so that what is answered is C's."""

    def failing(*_: object) -> None:
        raise AssertionError("C has no answer")

    monkeypatch.setattr(EquationsOfMotion, "rates", failing)


@pytest.mark.parametrize("passive", [True, False])
@pytest.mark.parametrize("name", ["crane", "puma", "hand", "four-bar", "standing"])
@pytest.mark.parametrize("tau", [None, "arrays", pull], ids=["none", "arrays", "function"])
def test_c_moves_robots_as_the_equations_in_arrays_do(name: str, tau: Any, passive: bool, made: Any) -> None:
    found = []
    for backend in ("numpy", "native"):
        robot, q, qd, how = made(name, backend)
        given = 1e-2 + 1e-2 * q if tau == "arrays" else tau
        with pytest.MonkeyPatch.context() as patch:
            if backend == "native":
                patch.setattr(EquationsOfMotion, "rates", None)
            found.append(robot.simulate(q, qd, TIME, given, passive=passive, step=4e-3, **how))
    for word in WORDS:
        one, other = (np.asarray(getattr(motion, word)) for motion in found)
        assert one.shape == other.shape
        assert np.abs(other - one).max() <= 1e-11 * np.abs(one).max(), word
    np.testing.assert_array_equal(found[1].time, TIME)


@pytest.mark.usefixtures("no_equations")
@pytest.mark.parametrize("name", ["crane", "four-bar", "standing"])
def test_a_motion_is_the_same_beside_others_and_alone(name: str, made: Any) -> None:
    robot, q, qd, how = made(name, "native")
    whole = robot.simulate(q, qd, TIME, pull, **how)
    for s in range(3):
        alone = robot.simulate(q[s], qd[s], TIME, pull, **how)
        for word in WORDS[:2]:
            np.testing.assert_array_equal(getattr(alone, word), getattr(whole, word)[:, s])
    single = robot.simulate(q.astype("f4"), qd.astype("f4"), TIME, pull, **how)
    assert single.q.dtype == np.float32
    assert relative_error(single.q, whole.q) <= 1e-4


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_motions_of_a_batch_exchange_their_independent_joints_by_themselves(
    backend: str, tmp_path: Path
) -> None:
    """The knee turns back at its ends, at another time in each motion, and tells nothing of the crank."""
    text = Path(CRANK).read_text("utf-8").replace("xyz = [0.8,", "xyz = [0.76,")
    (tmp_path / "rocks.toml").write_text(text, "utf-8")
    package = tmp_path / "rocks"
    write_package(generate(read_system(str(tmp_path / "rocks.toml")), ["numpy", "native"]), package)
    robot, around = import_package(package).load(backend), np.array([0.4, 1.9, 3.6])
    q = robot.constraints.closed(np.stack([around, -around, -1.9 + 0.0 * around], -1))
    qd = robot.constraints.velocity(q, np.array([[11.0], [-10.0], [12.0]]))
    rocked = robot.constrained(["knee"], at=q[0])
    time, tau = np.linspace(0.0, 0.6, 4), np.array([0.3, 0.0, 0.0])
    whole = robot.simulate(q, qd, time, tau, constraints=rocked, step=2e-3)
    assert np.abs(whole.energy_drift).max() <= 1e-5 * np.abs(whole.energy).max()
    for s in range(3):
        alone = robot.simulate(q[s], qd[s], time, tau, constraints=rocked, step=2e-3)
        assert relative_error(whole.q[:, s], alone.q) <= 1e-11
        assert relative_error(whole.qd[:, s], alone.qd) <= 1e-11


def test_lost_ties_and_motions_without_bound_are_told_as_in_arrays(
    package_of: Callable[[str], ModuleType],
) -> None:
    told: dict[str, list[str]] = {"numpy": [], "native": []}
    for backend, lines in told.items():
        robot = package_of(CRANK).load(backend)
        q = robot.constraints.closed(np.array([0.4, -0.4, -1.9]))
        rocked = robot.constrained(["knee"])
        for time in ([0.0, 2.0], np.linspace(0.0, 2.0, 21)):
            with pytest.raises(ValueError, match="the motion comes to a singular position") as error:
                robot.simulate(q, 0.0 * q, time, [0.0, 0.0, 30.0], constraints=rocked, step=0.01)
            lines.append(str(error.value))
        with pytest.raises(ValueError, match="crank leaps by") as error:
            robot.simulate(q, 0.0 * q, [0.0, 1.0], lambda t, q, qd: 1e9 * qd + 1.0, step=0.01)
        lines.append(str(error.value))
        crane = package_of(CRANE).load(backend)
        with (
            pytest.raises(ValueError, match="the motion is not finite at t = 2 s"),
            np.errstate(all="ignore"),
        ):
            crane.simulate(
                np.ones(crane.n), np.ones(crane.n), [0.0, 1.0, 2.0], lambda t, q, qd: 1e3 * qd * qd
            )
    assert told["numpy"] == told["native"]


def test_arrays_go_on_from_the_last_instant_that_c_has_reached(tmp_path: Path) -> None:
    """At 1 m/s the level slide comes to where its motor fails, at 1 m, and not before."""
    level = joint("ab", "a", "b", type="prismatic", rpy="0 0 0", axis="1 0 0")
    (tmp_path / "slide.urdf").write_text(chain(level))
    write_package(generate(read_system(tmp_path / "slide.urdf"), ["numpy", "native"]), tmp_path / "slide")
    for backend in ("numpy", "native"):
        robot = import_package(tmp_path / "slide").load(backend)
        with pytest.raises(ValueError, match="the motion is not finite at t = 1 s"):
            robot.simulate(
                [0.05],
                [1.0],
                np.arange(0.0, 1.6, 0.125),
                lambda t, q, qd: np.where(q < 1.0, 0.0, np.nan),
                step=0.125,
            )


class Tired(Exception):
    """Error of a user's own."""


@pytest.mark.usefixtures("no_equations")
@pytest.mark.parametrize("name", ["crane", "four-bar"])
def test_what_a_controller_raises_comes_through_and_is_let_go(name: str, made: Any) -> None:
    robot, q, qd, how = made(name, "native")
    kept: list[Any] = []

    def tires(t: float, q: Any, qd: Any) -> Any:
        if t > 0.12:
            error = Tired("out of breath")
            kept.append(weakref.ref(error))
            raise error
        return 0.0 * q

    with pytest.raises(Tired, match="out of breath"):
        robot.simulate(q, qd, TIME, tires, **how)
    gc.collect()
    assert [one() for one in kept] == [None]
    with pytest.raises(ValueError, match="tau"):
        robot.simulate(q, qd, TIME, lambda t, q, qd: np.ones(robot.n + 1), **how)


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("real", ["double", "float"])
def test_a_controller_may_be_a_function_of_c(backend: str, real: str, made: Any, tmp_path: Path) -> None:
    robot, q, qd, how = made("four-bar", backend)
    low = pytest.importorskip("scipy").LowLevelCallable
    kind, near = (np.float64, 1e-12) if real == "double" else (np.float32, 1e-5)
    q, qd = q.astype(kind), qd.astype(kind)
    (tmp_path / "hold.c").write_text(HOLD.format(real=real, n=robot.n))
    command = ["gcc", "-shared", "-fPIC", "-O1", "hold.c", "-o", "hold.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    hold = ctypes.CDLL(str(tmp_path / "hold.so")).hold
    hold.restype, hold.argtypes = CONTROLLER._restype_, CONTROLLER._argtypes_
    gain = np.array([0.5, 0.05], kind)
    expected = robot.simulate(q, qd, TIME, lambda t, q, qd: -gain[0] * q - gain[1] * qd, **how)
    place = ctypes.cast(gain.ctypes.data, ctypes.c_void_p)
    found = robot.simulate(q, qd, TIME, low(hold, place), **how)
    for word in WORDS:
        assert relative_error(getattr(found, word), getattr(expected, word)) <= near
    address = ctypes.cast(hold, ctypes.c_void_p).value
    assert address
    for bare in (hold, CONTROLLER(address)):
        early = robot.simulate(q, qd, TIME[:2], bare, **how)
        np.testing.assert_allclose(early.tau, TIME[:2, None, None] + 0.0 * early.q, rtol=1e-6)
        with pytest.raises(ValueError, match=r"^the controller answered with status 7 "):
            robot.simulate(q, qd, TIME, bare, **how)


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_any_status_of_a_function_of_c_ends_the_motion(backend: str, made: Any) -> None:
    """Statuses are the controller's, whatever C's own numbers mean: here of torques that are refused once."""
    robot, q, qd, _ = made("four-bar", backend)
    for status in (1, 7, 10, -3):
        left = [3, status]

        @CONTROLLER
        def once(context: int, time: float, count: int, q: int, qd: int, tau: int, left: Any = left) -> int:
            left[0] -= 1
            return left[1] if left[0] == 0 else 0

        with pytest.raises(ValueError, match=rf"^the controller answered with status {abs(status)} "):
            robot.simulate(q, qd, TIME, once)
    with pytest.raises(ValueError, match="tau is a function of C at address 0"):
        robot.simulate(q, qd, TIME, CONTROLLER(0))


def test_what_a_handler_of_signals_raises_comes_through(made: Any) -> None:
    """Handlers run where a callback begins, before it could catch anything: ctypes drops what they raise."""
    robot, q, qd, _ = made("four-bar", "native")

    def handler(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before, hook = signal.signal(signal.SIGALRM, handler), sys.unraisablehook
    try:
        for wait in np.linspace(0.02, 0.06, 5):
            signal.setitimer(signal.ITIMER_REAL, float(wait))
            with pytest.raises(KeyboardInterrupt):
                robot.simulate(q, qd, np.linspace(0.0, 60.0, 601), lambda t, q, qd: -0.1 * qd, step=1e-3)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert sys.unraisablehook is hook


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_a_controller_may_write_into_what_it_is_given(backend: str, made: Any) -> None:
    robot, q, qd, how = made("four-bar", backend)

    def rude(t: float, q: Any, qd: Any) -> Any:
        found = pull(t, q, qd)
        q[...] = qd[...] = 7.0
        return found

    expected = robot.simulate(q, qd, TIME, pull, step=5e-3, **how)
    np.testing.assert_array_equal(robot.simulate(q, qd, TIME, rude, step=5e-3, **how).q, expected.q)


def test_steps_that_are_far_too_long_end_where_those_in_arrays_do(made: Any) -> None:
    """Ways of some 25 rad, joints that change within a step, and closings that take all steps of Newton's."""
    exact, compiled = (made("four-bar", name)[0] for name in ("numpy", "native"))
    found = 0
    for far in (-0.2, 0.1, 0.25):
        at = exact.constraints.closed(exact.constraints.closed_position + far * np.eye(3)[0])
        for speed in (-30.0, -10.0, 20.0, 30.0):
            qd = exact.constraints.velocity(at, np.array([speed]))
            for end in (0.05, 0.1, 0.2):
                told = []
                for robot in (exact, compiled):
                    try:
                        told.append(robot.simulate(at, qd, [0.0, end]).q)
                    except ValueError as error:
                        told.append(str(error))
                if isinstance(told[0], str):
                    assert told[0] == told[1]
                    continue
                np.testing.assert_allclose(*told, rtol=0, atol=1e-6 * np.abs(told[0]).max())
                found += 1
    assert found > 9


def test_tensors_are_not_for_functions_of_c(made: Any) -> None:
    torch = pytest.importorskip("torch")
    robot, q, qd, how = made("crane", "native")
    drives = CONTROLLER(lambda *_: 0)
    with pytest.raises(TypeError, match="tau is a function of C, which takes NumPy arrays"):
        robot.simulate(torch.from_numpy(q), torch.from_numpy(qd), TIME, drives, **how)


def test_loads_and_what_c_does_not_have_go_on_in_arrays(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of(CRANE)
    found = []
    for backend in ("numpy", "native"):
        robot = package.load(backend)
        q = np.full(robot.n, 0.2)
        load = package.AppliedLoad(robot.link_names[-1], [5.0, -4.0, 8.0])
        by_function = robot.simulate(q, q, TIME, None, lambda t, q, qd, load=load: [load])
        found.append(robot.simulate(q, q, TIME, None, [load]))
        assert relative_error(by_function.q, found[-1].q) <= 1e-12
        assert relative_error(robot.simulate(q, q, TIME).q, found[-1].q) > 1e-4
    assert relative_error(found[1].q, found[0].q) <= 1e-11
