"""The calls of a generated package: shapes, dtypes, gradients, conventions, masks and messages."""

import pickle
from collections.abc import Callable
from copy import deepcopy
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import random_states, relative_error

torch = pytest.importorskip("torch")

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
TORCH = ("torch", "autograd")


def states_of(backend: str, *shape: int, dtype: str = "float64") -> tuple[Any, ...]:
    arrays = np.random.default_rng(1).uniform(-2.0, 2.0, (3, *shape)).astype(dtype)
    return tuple(arrays) if backend in ("numpy", "native") else tuple(torch.from_numpy(arrays))


@pytest.mark.parametrize("batch", [(), (1,), (5,), (2, 3), (0,)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_any_batch_shape(
    backend: str, batch: tuple[int, ...], package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("puma560").load(backend)
    n, links = robot.n, robot.N
    q, qd, qdd = states_of(backend, *batch, n)
    mask = np.ones((3, n))
    coefficients, propagation = robot.coefficients(q, qd), robot.propagation(q, qd, qdd)
    for answer in (coefficients, propagation):
        assert tuple(answer.acceleration.shape) == (*batch, n, links, n)
        assert tuple(answer.velocity.shape) == (*batch, n, links, n)
        assert tuple(answer.gravity.shape) == (*batch, n, links)
    assert tuple(robot.partial_torque(q, qd, qdd).shape) == (*batch, n, links)
    assert tuple(robot.inverse_dynamics(q, qd, qdd).shape) == (*batch, n)
    assert tuple(robot.position_gradient(q, qd, qdd).shape) == (*batch, n, links, n)
    assert tuple(robot.masked(q, qd, qdd, mask).shape) == (*batch, n, links)


@pytest.mark.parametrize("backend", BACKENDS)
def test_motions_of_unequal_batch_shape_broadcast(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, _ = states_of(backend, 4, 3)
    rest = 0 * q[0]
    whole = robot.partial_torque(q, qd, 0 * q)
    assert relative_error(robot.partial_torque(q, qd, rest), whole) == 0.0


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_the_callers_dtype_is_kept(backend: str, dtype: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = states_of(backend, 6, 3, dtype=dtype)
    exact = package_of("planar3").load("numpy").partial_torque(*(np.asarray(m, float) for m in (q, qd, qdd)))
    answers = [
        robot.partial_torque(q, qd, qdd),
        robot.inverse_dynamics(q, qd, qdd),
        *robot.coefficients(q, qd),
        *robot.propagation(q, qd, qdd)[:3],
        robot.position_gradient(q, qd, qdd),
        robot.masked(q, qd, qdd, np.eye(3)),
    ]
    assert {str(a.dtype).removeprefix("torch.") for a in answers} == {dtype}
    assert relative_error(answers[0], exact) <= (1e-5 if dtype == "float32" else 1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("convention", "share"), [("closing", 1.0), ("gradient", 2.0)])
def test_conventions_name_how_often_the_velocity_force_is_counted(
    backend: str, convention: str, share: float, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("puma560").load(backend)
    states = states_of(backend, 20, 6)
    parts = robot.propagation(*states, convention=convention)
    assert parts.convention == convention
    rest = parts.acceleration.sum(-1) + parts.gravity
    assert relative_error(parts.velocity.sum(-1) / share + rest, robot.partial_torque(*states)) <= 1e-13


@pytest.mark.parametrize("backend", BACKENDS)
def test_mask_selects_orders_and_coordinates(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    states = states_of(backend, 8, 3)
    parts, c0 = robot.propagation(*states), robot.position_gradient(*states)
    motions = np.zeros((3, 3))
    motions[1:] = 1.0
    whole = robot.masked(*states, motions) + parts.gravity
    assert relative_error(whole, robot.partial_torque(*states)) <= 1e-13
    for order, expected in enumerate((c0 * states[0][:, None, None, :], parts.velocity, parts.acceleration)):
        single = np.zeros((3, 3))
        single[order, 1] = 1.0
        assert relative_error(robot.masked(*states, single), expected[..., 1]) <= 1e-14


@pytest.mark.parametrize("backend", BACKENDS)
def test_torques_off_the_path_are_exactly_zero(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    tau = np.asarray(package_of("puma560").load(backend).partial_torque(*states_of(backend, 5, 6)))
    below = np.tril_indices(6, -1)
    assert (tau[:, *below] == 0.0).all()
    assert (tau[:, *np.triu_indices(6)] != 0.0).sum() > 5 * 15


@pytest.mark.parametrize("backend", [*TORCH, pytest.param("native", marks=needs_compiler)])
def test_gradients_flow_through_motion(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = (m.requires_grad_() for m in states_of("torch", 3))
    for call in ("packed_torque", "partial_torque", "inverse_dynamics", "position_gradient"):
        function = getattr(robot, call)
        assert torch.autograd.gradcheck(function, (q, qd, qdd)), call
    assert torch.autograd.gradcheck(lambda a, b: tuple(robot.coefficients(a, b)), (q, qd))
    assert torch.autograd.gradcheck(lambda *m: tuple(robot.packed(*m)[:4]), (q, qd, qdd))


@pytest.mark.parametrize("backend", TORCH)
def test_slope_of_the_torque_is_the_position_gradient(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = states_of(backend, 3)
    slope = torch.autograd.functional.jacobian(lambda x: robot.partial_torque(x, qd, qdd), q)
    assert relative_error(robot.position_gradient(q, qd, qdd), slope) <= 1e-13


@pytest.mark.parametrize("parameter", ["m_2", "l_1", "I_3", "r_2"])
@pytest.mark.parametrize("backend", TORCH)
def test_gradients_flow_through_symbolic_parameters(
    backend: str, parameter: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3 symbolic")
    states = states_of(backend, 4, 3)
    value = package.parameters[parameter]

    def torque(p: Any) -> Any:
        return package.load(backend, parameters={parameter: p}).partial_torque(*states)

    slope = torch.autograd.functional.jacobian(torque, torch.tensor(value, dtype=torch.float64))
    step = 1e-4 * value
    difference = (torque(value + step) - torque(value - step)) / (2 * step)
    assert relative_error(slope, difference) <= 1e-8


@pytest.mark.parametrize("backend", BACKENDS)
def test_symbolic_parameters_default_to_the_robots_numbers(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    states = states_of(backend, 7, 3)
    numeric, symbolic = (package_of(robot).load(backend) for robot in ("planar3", "planar3 symbolic"))
    assert relative_error(symbolic.partial_torque(*states), numeric.partial_torque(*states)) <= 1e-14


def test_unknown_parameter_and_backend_are_named(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of("planar3 symbolic")
    with pytest.raises(
        ValueError,
        match=r"no parameter 'm_9' in any number; near it are m_1, m_2, m_3, l_1, r_1, I_1, and `",
    ):
        package.load("numpy", parameters={"m_9": 1.0})
    with pytest.raises(ValueError, match=r"no back end 'jax'.*choose one of numpy, torch, autograd"):
        package.load("jax")
    with pytest.raises(ValueError, match="no convention 'half'; choose closing or gradient"):
        package.load("numpy").propagation(*random_states(3, 1), convention="half")


@pytest.mark.parametrize("call", ["partial_torque", "inverse_dynamics", "position_gradient"])
def test_closed_forms_run_under_vmap(call: str, package_of: Callable[[str], ModuleType]) -> None:
    function = getattr(package_of("puma560").load("torch"), call)
    states = states_of("torch", 4, 6)
    assert relative_error(torch.func.vmap(function)(*states), function(*states)) <= 1e-15


@pytest.mark.parametrize("call", ["propagation", "packed", "masked"])
def test_calls_with_many_results_run_under_vmap(call: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load("torch")
    states = states_of("torch", 4, 3)
    arguments = (*states, torch.ones(4, 3, 3)) if call == "masked" else states
    mapped = torch.func.vmap(getattr(robot, call))(*arguments)
    plain = getattr(robot, call)(*states, *([np.ones((3, 3))] if call == "masked" else []))
    for one, other in zip(mapped, plain, strict=True):
        torch.testing.assert_close(one, other)


def test_the_layout_cannot_be_changed_by_accident(package_of: Callable[[str], ModuleType]) -> None:
    with pytest.raises(ValueError, match="read-only"):
        package_of("planar3").load("numpy").layout.torque[:] = 0


def test_coefficients_run_under_vmap(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("puma560").load("torch")
    q, qd, _ = states_of("torch", 4, 6)
    mapped, plain = torch.func.vmap(robot.coefficients)(q, qd), robot.coefficients(q, qd)
    for one, other in zip(mapped, plain, strict=True):
        assert relative_error(one, other) <= 1e-15


@pytest.mark.parametrize("backend", BACKENDS)
def test_wrong_shape_names_the_argument(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = states_of(backend, 5, 3)
    with pytest.raises(
        ValueError, match=r"qd has shape \(5, 2\); its last axis must be 3, one for each joint"
    ):
        robot.partial_torque(q, qd[:, :2], qdd)


MASKS: dict[str, tuple[Any, str]] = {
    "complex": (np.ones((3, 3), complex), "the mask has dtype complex128; give real numbers"),
    "a complex tensor": (
        torch.ones(3, 3, dtype=torch.complex64),
        "the mask has dtype complex64; give real numbers",
    ),
    "words": ([["1"] * 3] * 3, "the mask has dtype str32; give real numbers"),
    "objects": (np.full((3, 3), None), "the mask has dtype object; give real numbers"),
    "gaps": (np.ma.masked_equal(np.eye(3), 0), "the mask is a masked array; fill its gaps first"),
    "None": (None, "the mask is None; give an array, a tensor or a list"),
    "one number": (1.0, r"the mask has shape \(\); it must be \(3, 3\): order, coordinate"),
    "a row too few": (np.ones((2, 3)), r"the mask has shape \(2, 3\); it must be \(3, 3\)"),
    "a mask a sample": (torch.ones(5, 3, 3), r"the mask has shape \(5, 3, 3\); it must be \(3, 3\)"),
    "rows unlike": ([[1, 1, 1], [1, 1], [1]], "the mask does not read as an array: "),
}


@pytest.mark.parametrize("mask", MASKS)
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_no_mask_is_named(backend: str, mask: str, package_of: Callable[[str], ModuleType]) -> None:
    robot, (given, message) = package_of("planar3").load(backend), MASKS[mask]
    with pytest.raises((TypeError, ValueError), match=f"^{message}") as error:
        robot.masked(*states_of(backend, 5, 3), given)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_mask_may_be_of_truth_values_numbers_or_tensors(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot, states = package_of("planar3").load(backend), states_of(backend, 5, 3)
    mask = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 1]])
    expected = robot.masked(*states, mask.astype(float))
    for same in (mask, mask.tolist(), mask.astype(bool), mask.astype("f2"), torch.from_numpy(mask)):
        assert (robot.masked(*states, same) == expected).all()


def test_tensors_on_different_devices_are_refused(package_of: Callable[[str], ModuleType]) -> None:
    q = torch.ones(3, dtype=torch.float64)
    with pytest.raises(TypeError, match="q, qd, qdd lie on different devices; move them to one"):
        package_of("planar3").load("torch").partial_torque(q, q, q.to("meta"))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_copied_or_pickled_robot_keeps_back_end_and_parameters(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3 symbolic").load(backend, parameters={"m_2": 2.0})
    states = states_of(backend, 4, 3)
    for again in (deepcopy(robot), pickle.loads(pickle.dumps(robot))):
        assert again.backend.name == backend
        assert relative_error(again.partial_torque(*states), robot.partial_torque(*states)) == 0.0


@pytest.mark.parametrize("call", ["partial_torque", "position_gradient", "inverse_dynamics"])
@pytest.mark.parametrize("backend", TORCH)
def test_answers_are_the_same_in_every_grad_mode(
    backend: str, call: str, package_of: Callable[[str], ModuleType]
) -> None:
    function = getattr(package_of("planar3").load(backend), call)
    arrays = states_of("numpy", 5, 3)
    expected = getattr(package_of("planar3").load("numpy"), call)(*arrays)
    with torch.inference_mode():
        assert relative_error(function(*map(torch.from_numpy, arrays)), expected) <= 1e-14
    leaves = [torch.from_numpy(a).requires_grad_() for a in arrays]
    with torch.no_grad():
        silent = function(*leaves)
    assert not silent.requires_grad
    assert relative_error(silent, expected) <= 1e-14
    recorded = function(*leaves)
    assert recorded.requires_grad
    assert relative_error(recorded.detach(), expected) <= 1e-14


@pytest.mark.parametrize("call", ["mass_matrix", "gravity_torque", "christoffel", "coriolis_matrix"])
def test_a_velocity_too_many_is_not_taken_for_an_option(
    call: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot, motion = package_of("planar3").load("numpy"), [[0.1, 0.2, 0.3]] * 3
    with pytest.raises(TypeError, match="positional arguments but"):
        getattr(robot, call)(*motion)
