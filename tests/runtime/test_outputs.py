"""`out`: every call writes its answer where it is told to, or says in one line why it cannot."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler

torch = pytest.importorskip("torch")

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
CALLS: dict[str, Callable[..., Any]] = {
    "packed": lambda r, m, out: r.packed(*m, out=out),
    "packed_torque": lambda r, m, out: r.packed_torque(*m, out=out),
    "partial_torque": lambda r, m, out: r.partial_torque(*m, out=out),
    "inverse_dynamics": lambda r, m, out: r.inverse_dynamics(*m, out=out),
    "coefficients": lambda r, m, out: r.coefficients(*m[:2], out=out),
    "propagation": lambda r, m, out: r.propagation(*m, out=out),
    "gradient": lambda r, m, out: r.propagation(*m, "gradient", out),
    "position_gradient": lambda r, m, out: r.position_gradient(*m, out=out),
    "masked": lambda r, m, out: r.masked(*m, np.ones((3, 3)), out=out),
}


def motion_of(backend: str, *shape: int, tensors: bool = False) -> list[Any]:
    arrays = np.random.default_rng(2).uniform(-2.0, 2.0, (3, *shape, 3))
    as_tensors = tensors or backend in ("torch", "autograd")
    return [torch.from_numpy(a) for a in arrays] if as_tensors else list(arrays)


def parts(answer: Any) -> tuple[Any, ...]:
    return tuple(answer) if isinstance(answer, tuple) else (answer,)


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize(
    ("backend", "tensors"),
    [
        *((b, False) for b in BACKENDS[:3]),
        pytest.param("native", False, marks=needs_compiler),
        pytest.param("native", True, marks=needs_compiler),
    ],
)
def test_the_answer_is_written_and_returned(
    backend: str, tensors: bool, call: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    for shape in ((), (5,), (2, 3), (0,)):
        motion = motion_of(backend, *shape, tensors=tensors)
        expected = CALLS[call](robot, motion, None)
        places = [p.clone() if torch.is_tensor(p) else p.copy() for p in parts(expected)]
        for place in places:
            place[...] = np.nan
        out = type(expected)(*places) if isinstance(expected, tuple) else places[0]
        answer = CALLS[call](robot, motion, out)
        assert type(answer) is type(expected)
        for place, given, value in zip(places, parts(answer), parts(expected), strict=True):
            assert given is place
            assert bool((given == value).all())


def flipped(a: Any) -> Any:
    return a.mT.contiguous().mT if torch.is_tensor(a) else np.asfortranarray(a)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_cannot_hold_the_answer_is_named(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    motion = motion_of(backend, 4)
    right = robot.partial_torque(*motion)
    single = right.float() if torch.is_tensor(right) else right.astype("f4")
    kind = "a tensor" if torch.is_tensor(right) else "an array"
    wrong = {
        r"^out has shape \(2, 3, 3\); the answer has \(4, 3, 3\)$": right[:2],
        "^out has dtype float32; the answer has float64$": single,
        f"^out is a list of 4; the answer is {kind}$": right.tolist(),
        "^out overlaps qd; give it memory of its own$": None,
    }
    if backend == "native":
        wrong["^out is not contiguous; give what empty"] = flipped(right)
    else:
        assert (robot.partial_torque(*motion, out=flipped(right)) == right).all()
    if torch.is_tensor(right):
        wrong["^out lies on meta; the answer lies on cpu$"] = right.to("meta")
    for message, out in wrong.items():
        if out is None:
            room = right.reshape(-1)
            out, motion[1] = room.reshape(4, 3, 3), room[12:24].reshape(4, 3)
        with pytest.raises((TypeError, ValueError), match=message):
            robot.partial_torque(*motion, out=out)


@pytest.mark.parametrize("backend", BACKENDS)
def test_several_results_are_named_one_by_one(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load(backend)
    motion = motion_of(backend, 4)
    c2, c1, g = robot.propagation(*motion)
    with pytest.raises(TypeError, match="out is a tuple of 2; give 3 of them: acceleration, velocity, grav"):
        robot.propagation(*motion, out=(c2, c1))
    with pytest.raises(ValueError, match=r"^out\.acceleration overlaps out\.velocity; give it"):
        robot.propagation(*motion, out=(c2, c2, g))
    with pytest.raises(ValueError, match=r"^out.gravity has shape \(3, 3\); the answer has \(4, 3, 3\)"):
        robot.propagation(*motion, out=[c2, c1, g[0]])


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_compiler)])
def test_an_array_that_is_read_only_is_named(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot, motion = package_of("planar3").load(backend), motion_of(backend, 4)
    out = robot.inverse_dynamics(*motion)
    out.flags.writeable = False
    with pytest.raises(ValueError, match=r"^out is read-only; give an array that may be written to$"):
        robot.inverse_dynamics(*motion, out=out)


@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_where_a_gradient_is_recorded_there_is_no_out(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot, motion = package_of("planar3").load(backend), motion_of(backend, 4, tensors=True)
    out = robot.inverse_dynamics(*motion)
    motion[1].requires_grad_()
    with pytest.raises(TypeError, match=r"^out keeps no gradient, which the motion or a parameter requires"):
        robot.inverse_dynamics(*motion, out=out)
    with torch.no_grad():
        assert robot.inverse_dynamics(*motion, out=out) is out


@pytest.mark.parametrize("backend", BACKENDS[:3])
def test_an_array_that_overlaps_itself_is_refused(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot, motion = package_of("planar3").load(backend), motion_of(backend, 5)
    room = np.empty(60)
    overlapping = np.lib.stride_tricks.as_strided(room, (5, 3, 3), (16, 24, 8))
    fortran = np.asfortranarray(np.empty((5, 3, 3)))
    if backend != "numpy":
        overlapping, fortran = (torch.from_numpy(a) for a in (overlapping, fortran))
    with pytest.raises(ValueError, match=r"^out overlaps itself; give it memory of its own$"):
        robot.partial_torque(*motion, out=overlapping)
    robot.partial_torque(*motion, out=fortran)
