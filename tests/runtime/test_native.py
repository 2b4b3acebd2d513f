"""The native back end: what its compiled code must not get wrong."""

import gc
import inspect
import multiprocessing
import pickle
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from copy import copy, deepcopy
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch
from conftest import needs_compiler
from helpers.answers import relative_error
from helpers.urdf_text import chain, joint
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

pytestmark = needs_compiler


@pytest.fixture(scope="module")
def planar3(package_of: Callable[[str], ModuleType]) -> ModuleType:
    return package_of("planar3")


@pytest.fixture(scope="module")
def planar3_symbolic(package_of: Callable[[str], ModuleType]) -> ModuleType:
    return package_of("planar3 symbolic")


@pytest.fixture(scope="module")
def motion() -> np.ndarray:
    return np.random.default_rng(0).uniform(
        -2.0, 2.0, (3, 24000, 3)
    )  # every result is large enough for a block


def test_a_parameter_that_is_learned_counts_with_its_present_value(planar3_symbolic: ModuleType) -> None:
    mass = torch.tensor(0.6, dtype=torch.float64, requires_grad=True)
    native = planar3_symbolic.load("native", {"m_1": mass})
    reference = planar3_symbolic.load("torch", {"m_1": mass})
    motion = torch.linspace(-1.0, 1.0, 9, dtype=torch.float64).reshape(3, 3)
    with torch.no_grad():
        mass += 1.0
        torch.testing.assert_close(native.inverse_dynamics(*motion), reference.inverse_dynamics(*motion))
    arrays = native.inverse_dynamics(*motion.numpy())
    np.testing.assert_allclose(arrays, reference.inverse_dynamics(*motion).detach().numpy())


def test_second_derivatives_are_those_of_torch(planar3: ModuleType) -> None:
    motion = torch.linspace(-1.0, 1.0, 9, dtype=torch.float64).reshape(3, 3).requires_grad_()

    def curvature(backend: str) -> torch.Tensor:
        torque = planar3.load(backend).inverse_dynamics(*motion)
        (slope,) = torch.autograd.grad(torque.square().sum(), motion, create_graph=True)
        (second,) = torch.autograd.grad(slope.square().sum(), motion)
        return second

    torch.testing.assert_close(curvature("native"), curvature("torch"))


def test_a_process_forked_after_a_large_batch_works(planar3: ModuleType, motion: np.ndarray) -> None:
    robot = planar3.load("native")
    robot.backend.threads = 2
    expected = robot.inverse_dynamics(*np.tile(motion, (1, 20, 1)))

    def child(queue: multiprocessing.Queue) -> None:  # type: ignore[type-arg]
        queue.put(robot.inverse_dynamics(*np.tile(motion, (1, 20, 1))).sum())

    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    process = context.Process(target=child, args=(queue,))
    process.start()
    assert queue.get(timeout=30) == pytest.approx(expected.sum())
    process.join()


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_results_begin_on_a_cache_line(planar3: ModuleType, motion: np.ndarray, dtype: str) -> None:
    """Stores past the cache are of whole lines."""
    robot = planar3.load("native")
    held = [robot.packed_torque(*motion[:, :count].astype(dtype)) for count in range(3000, 3032)]
    assert {torque.ctypes.data % 64 for torque in held} == {0}


@pytest.mark.parametrize("backend", ["numpy", "torch", "native"])
def test_a_loaded_robot_can_be_copied_and_pickled(planar3: ModuleType, backend: str) -> None:
    robot = planar3.load(backend)
    assert deepcopy(robot).joint_names == robot.joint_names
    assert pickle.loads(pickle.dumps(robot)).backend.name == backend


def test_threads_give_the_same_numbers(planar3: ModuleType, motion: np.ndarray) -> None:
    robot = planar3.load("native")
    many = np.tile(motion, (1, 30, 1))
    robot.backend.threads = 1
    one = robot.packed(*many).velocity
    robot.backend.threads = 3
    np.testing.assert_array_equal(robot.packed(*many).velocity, one)


@pytest.mark.parametrize("count", [0, -1, 2.0, "2", True, None, np.ones(2)])
def test_threads_are_a_whole_number_from_1_on(count: Any, planar3: ModuleType) -> None:
    backend = planar3.load("native").backend
    backend.threads = np.int64(3)
    with pytest.raises((TypeError, ValueError), match=r"^threads is .*; give a whole number from 1 on$"):
        backend.threads = count
    assert backend.threads == 3


def test_threads_are_those_of_copies_and_where_gradients_are_recorded(
    planar3: ModuleType, motion: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = planar3.load("native")
    assert pickle.loads(pickle.dumps(robot)).backend.threads_set is None
    robot.backend.threads = 3
    for again in (copy(robot), deepcopy(robot), pickle.loads(pickle.dumps(robot))):
        assert again.backend.threads == 3
    parts = []
    share = type(robot.backend.calls).share
    monkeypatch.setattr(
        type(robot.backend.calls), "share", lambda *given: (parts.append(given[4]), share(*given))
    )
    q, qd, qdd = torch.from_numpy(np.tile(motion, (1, 4, 1)))
    robot.packed_torque(q.requires_grad_(), qd, qdd).sum().backward()
    assert parts == [3]


HOLDINGS: dict[str, Callable[[Any], Any]] = {
    "the answer": lambda answer: answer,
    "a field": lambda answer: answer.velocity,
    "a slice": lambda answer: answer.torque[::7, 1],
    "a view": lambda answer: answer.velocity.reshape(-1).view(np.uint8),
    "a view of a view": lambda answer: answer.velocity[1:][::2].T,
    "its base": lambda answer: answer.velocity.base,
    "a tensor": lambda answer: torch.from_numpy(answer.velocity),
    "a slice of a tensor": lambda answer: torch.from_numpy(answer.velocity)[5:, 1],
    "a buffer": lambda answer: memoryview(answer.velocity),
}
"""Ways in which a user may hold on to results."""


def values_of(held: Any) -> list[np.ndarray]:
    return [np.asarray(a).copy() for a in (held if isinstance(held, tuple) else (held,))]


@pytest.fixture
def nobody_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """An object's count of references is the interpreter's own affair, and changed with Python 3.14."""
    monkeypatch.setattr(sys, "getrefcount", lambda _: 2)


def test_memory_that_nobody_holds_is_taken_again(planar3: ModuleType, motion: np.ndarray) -> None:
    robot = planar3.load("native")
    robot.backend.threads = 1
    places = {robot.partial_torque(*motion).__array_interface__["data"][0] for _ in range(20)}
    held = [robot.partial_torque(*motion) for _ in range(4)]
    assert len(places) == 1
    assert len({tau.ctypes.data for tau in held}) == 4


@pytest.mark.usefixtures("nobody_counts")
@pytest.mark.parametrize("holding", HOLDINGS)
def test_results_that_are_held_stay_as_they_are(
    holding: str, planar3: ModuleType, motion: np.ndarray
) -> None:
    robot = planar3.load("native")
    held = [HOLDINGS[holding](robot.packed(*(scale * motion))) for scale in (1.0, 0.5, 0.25)]
    before = [values_of(one) for one in held]
    gc.collect()
    for _ in range(8):
        robot.packed(*(3.0 * motion))
    for one, values in zip(held, before, strict=True):
        for now, then in zip(values_of(one), values, strict=True):
            np.testing.assert_array_equal(now, then)


@pytest.mark.usefixtures("nobody_counts")
def test_tensors_that_are_held_stay_as_they_are(planar3: ModuleType, motion: np.ndarray) -> None:
    robot = planar3.load("native")
    q, qd, qdd = torch.from_numpy(motion)
    held = [robot.packed(q, scale * qd, qdd).velocity[::3] for scale in (1.0, 2.0)]
    before = [values_of(one) for one in held]
    for _ in range(8):
        robot.packed(q, 3.0 * qd, qdd)
    for one, values in zip(held, before, strict=True):
        np.testing.assert_array_equal(values_of(one)[0], values[0])


@pytest.mark.usefixtures("nobody_counts")
def test_threads_that_ask_side_by_side_keep_their_own_results(
    planar3: ModuleType, motion: np.ndarray
) -> None:
    robot, reference = planar3.load("native"), planar3.load("numpy")

    def ask(scale: float) -> list[np.ndarray]:
        return [robot.packed(*(scale * step * motion)).velocity for step in range(1, 6)]

    scales = np.linspace(0.1, 1.0, 8)
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(ask, scales))
    for scale, held in zip(scales, answers, strict=True):
        for step, velocity in enumerate(held, 1):
            expected = reference.packed(*(scale * step * motion)).velocity
            np.testing.assert_allclose(velocity, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_results_beyond_64_mib_are_those_of_a_small_batch(
    planar3: ModuleType, motion: np.ndarray, dtype: type, threads: int
) -> None:
    robot = planar3.load("native")
    robot.backend.threads = threads
    few = robot.packed(*motion.astype(dtype))
    sample = sum(values.nbytes for values in few) // motion.shape[1]
    times = (64 << 20) // (sample * motion.shape[1]) + 1
    many, held = np.tile(motion.astype(dtype), (1, times, 1)), None
    for _ in range(2):
        before, held = held, robot.packed(*many)
    for answer in (before, held):
        assert sum(values.nbytes for values in answer) > 64 << 20
        for field, values in zip(few, answer, strict=True):
            assert (values.reshape(times, len(motion[0]), -1) == field).all()


# Torch itself warns of a deprecation when forward mode is first used.
@pytest.mark.filterwarnings("ignore:`torch.jit:DeprecationWarning")
def test_transformations_that_need_more_than_values_are_refused(planar3: ModuleType) -> None:
    robot = planar3.load("native")
    q = torch.ones(3, dtype=torch.float64)
    with pytest.raises(TypeError, match="take torch"):
        torch.func.vmap(lambda x: robot.inverse_dynamics(x, q, q))(torch.ones(2, 3, dtype=torch.float64))
    with torch.autograd.forward_ad.dual_level():
        dual = torch.autograd.forward_ad.make_dual(q, q)
        with pytest.raises(TypeError, match="take torch"):
            robot.inverse_dynamics(dual, q, q)


def test_subclasses_and_negated_views_of_tensors_are_tensors(planar3: ModuleType) -> None:
    class Special(torch.Tensor):
        pass

    robot = planar3.load("native")
    q = torch.ones(3, dtype=torch.float64)
    assert torch.is_tensor(robot.inverse_dynamics(q.as_subclass(Special), q, q))
    view = torch._neg_view(q)
    torch.testing.assert_close(robot.inverse_dynamics(view, q, q), robot.inverse_dynamics(-q, q, q))


def calls_of_motion(robot: Any) -> dict[str, int]:
    """Calls of a robot that ask for q, qd and qdd alone, and for how many of them."""
    asked = {}
    # Programs answer the one, and no arrays; the other asks for what is uncertain.
    for name in {*dir(robot)} - {"share_bounds", "uncertainty"}:
        call = getattr(type(robot), name, None)
        if callable(call) and not name.startswith("_"):
            given = inspect.signature(call).parameters
            needed = [one.name for one in given.values() if one.default is one.empty][1:]
            if needed and "tau" not in given and needed == ["q", "qd", "qdd"][: len(needed)]:
                asked[name] = len(needed)
    return asked


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32], ids=str)
@pytest.mark.parametrize("batch", [(), (4,)], ids=str)
def test_tensors_without_gradient_are_answered_by_every_call_as_arrays_are(
    planar3: ModuleType, batch: tuple[int, ...], dtype: torch.dtype
) -> None:
    robot = planar3.load("native")
    motion = torch.linspace(-1.0, 1.0, 36, dtype=dtype).reshape(3, 4, 3)
    motion = motion if batch else motion[:, 0]
    calls = calls_of_motion(robot)
    assert {"regressor", "coefficient_regressors", "mass_matrix", "energy", "packed"} <= calls.keys()
    for name, count in calls.items():
        few = motion[:count]
        answers = [getattr(robot, name)(*given) for given in (few, few.numpy())]
        fields = [each if isinstance(each, tuple) else (each,) for each in answers]
        for ours, expected in zip(*fields, strict=True):
            assert torch.is_tensor(ours), name
            np.testing.assert_allclose(ours.numpy(), expected, rtol=0, atol=1e-5, err_msg=name)


def test_what_hangs_on_no_input_has_a_gradient_of_zeros(tmp_path: Path) -> None:
    """Inertia, weight and stiffness of a slide are constants."""
    file = tmp_path / "slide.urdf"
    file.write_text(chain(joint("slide", "a", "b", type="prismatic")), encoding="utf-8")
    write_package(generate(read_system(file)), tmp_path / "slide")
    robot = import_package(tmp_path / "slide").load("native")
    q, qd, qdd = torch.ones(3, 4, 1, dtype=torch.float64).requires_grad_()
    for answer in (robot.position_gradient(q, qd, qdd), robot.mass_matrix(q)):
        (slope,) = torch.autograd.grad(answer.sum(), q)
        assert slope.shape == q.shape
        assert not slope.any()


@pytest.mark.parametrize("as_given", [np.array, torch.tensor, np.float32])
def test_a_parameter_of_no_axes_is_one_number_for_all_samples(
    planar3_symbolic: ModuleType, as_given: Callable[[float], Any]
) -> None:
    native, arrays = (planar3_symbolic.load(name, {"m_1": as_given(0.75)}) for name in ("native", "numpy"))
    for batch in ((), (5,)):
        q, qd = np.random.default_rng(8).uniform(-1, 1, (2, *batch, 3))
        expected = arrays.energy(q, qd)
        for answer in (native.energy(q, qd), native.energy(*map(torch.from_numpy, (q, qd)))):
            assert relative_error(np.stack(answer), np.stack(expected)) <= 1e-13
        assert relative_error(native.mass_matrix(q), arrays.mass_matrix(q)) <= 1e-13
    with pytest.raises(ValueError, match="parameter 'm_1' must be one number here"):
        planar3_symbolic.load("native", {"m_1": np.full(5, 0.75)})


def test_an_interrupted_call_lets_nobody_write_to_its_memory_any_more(
    package_of: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = package_of("planar3").load("native")
    robot.backend.threads = 2
    calls = robot.backend.calls
    motion, begun = np.ones((3, 40_000, 3)), threading.Event()
    out = np.empty((40_000, 3, 3))
    real = calls._function("partial_torque", np.dtype("f8"))

    def compute(count: int, q: int, *arrays: int) -> None:
        if q == motion[0].ctypes.data:  # the part of the caller's own thread
            begun.wait(10)
            raise KeyboardInterrupt
        begun.set()
        time.sleep(0.2)
        real(count, q, *arrays)

    monkeypatch.setitem(calls._functions, ("partial_torque", np.dtype("f8")), compute)
    with pytest.raises(KeyboardInterrupt):
        robot.partial_torque(*motion, out=out)
    out[...] = 0.0
    time.sleep(0.5)
    assert not out.any()


def test_what_is_written_to_is_known_to_have_changed(package_of: Callable[[str], ModuleType]) -> None:
    robot, q = package_of("planar3").load("native"), torch.ones(3, dtype=torch.float64)
    out, factor = (
        torch.ones(3, 3, dtype=torch.float64),
        torch.ones((), requires_grad=True, dtype=torch.float64),
    )
    product = (factor * out).sum()
    robot.partial_torque(q, q, q, out=out)
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        product.backward()


def for_control(robot: Any, q: Any, qd: Any, tau: Any) -> dict[str, Any]:
    """Return what C has functions of one sample for."""
    kinematics, point = robot.kinematics, [0.1, -0.2, 0.3]
    frame = kinematics.frames[-1]
    return {
        "pose": kinematics.pose(q, frame),
        "jacobian": kinematics.jacobian(q, frame, point),
        "at the origin": kinematics.jacobian(q, frame),
        "rate": kinematics.jacobian_rate(q, qd, frame, point),
        "mass": robot.mass_matrix(q),
        "qdd": robot.forward_dynamics(q, qd, tau),
    }


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("robot", ["torso", "puma560 loops"])
def test_c_answers_one_sample_of_what_control_needs(
    robot: str, dtype: str, package_of: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Arrays have no part in it: whatever they are asked for fails."""
    package = package_of(robot)
    native, arrays = package.load("native"), package.load("numpy")
    motion = np.random.default_rng(6).uniform(-1, 1, (3, native.n)).astype(dtype)
    expected = for_control(arrays, *motion.astype(float))

    def none(*asked: Any) -> None:
        pytest.fail("arrays were asked")

    monkeypatch.setattr(type(native.backend), "tree_numbers", none)
    monkeypatch.setattr(type(native.backend), "decomposition", none)
    for given in (motion, motion[:, None], motion.tolist()):
        for what, answer in for_control(native, *given).items():
            value = expected[what]
            assert answer.shape == np.shape(given)[1:-1] + value.shape
            assert answer.dtype == (np.float64 if isinstance(given, list) else dtype)
            error = np.abs(answer.reshape(value.shape) - value).max() / np.abs(value).max()
            assert error <= (1e-12 if dtype == "float64" else 1e-4), what
    out = np.empty((native.n, native.n), dtype)
    assert native.mass_matrix(motion[0], out=out) is out
    assert (out == native.mass_matrix(motion[0])).all()


def test_control_counts_with_the_present_values_of_what_is_learned(planar3_symbolic: ModuleType) -> None:
    own = dict(planar3_symbolic.parameters)
    learned = {name: torch.tensor(value, dtype=torch.float64) for name, value in own.items()}
    q = np.array([0.1, 0.2, 0.3])
    robot = planar3_symbolic.load("native", parameters=learned)
    before = robot.mass_matrix(q)
    for value in learned.values():
        value *= 1.5
    heavier = planar3_symbolic.load("native", parameters={name: 1.5 * value for name, value in own.items()})
    assert relative_error(robot.mass_matrix(q), heavier.mass_matrix(q)) <= 1e-14
    assert relative_error(before, heavier.mass_matrix(q)) > 0.1
    poses = [r.kinematics.pose(q, r.kinematics.frames[-1]) for r in (robot, heavier)]
    assert relative_error(*poses) <= 1e-14


def test_threads_that_ask_for_one_sample_keep_their_own_answers(planar3: ModuleType) -> None:
    robot, positions = planar3.load("native"), np.random.default_rng(7).uniform(-1, 1, (200, 3))
    expected = planar3.load("numpy").mass_matrix(positions)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(robot.mass_matrix, positions))
    assert relative_error(np.array(found), expected) <= 1e-13
