"""The compiled module that calls C says to the bit what ctypes says, and takes nothing that it should not."""

import gc
import inspect
import pickle
import sys
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from linkwise_runtime.native import build
from linkwise_runtime.native.compiler import MinGW

pytestmark = needs_compiler

TURNTABLE = str(DATA / "turntable.py")
CALLS: dict[str, Callable[..., Any]] = {
    "packed": lambda r, q, qd, qdd: r.packed(q, qd, qdd),
    "packed_torque": lambda r, q, qd, qdd: r.packed_torque(q, qd, qdd),
    "partial_torque": lambda r, q, qd, qdd: r.partial_torque(q, qd, qdd),
    "inverse_dynamics": lambda r, q, qd, qdd: r.inverse_dynamics(q, qd, qdd),
    "coefficients": lambda r, q, qd, qdd: r.coefficients(q, qd),
    "propagation": lambda r, q, qd, qdd: r.propagation(q, qd, qdd),
    "gradient": lambda r, q, qd, qdd: r.propagation(q, qd, qdd, convention="gradient"),
    "position_gradient": lambda r, q, qd, qdd: r.position_gradient(q, qd, qdd),
}


def module_of(package: ModuleType) -> Any:
    return import_module("linkwise_runtime.native.compiled_calls")


@contextmanager
def without(package: ModuleType, **instead: Any) -> Iterator[None]:
    """The package's module for Python made anew, with something else in place of what it finds."""
    module = module_of(package)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in instead.items():
            patch.setattr(module, name, value)
        module.compiled_calls.cache_clear()
        yield
    module.compiled_calls.cache_clear()


def is_compiled(robot: Any) -> bool:
    return "partial_torque" in vars(robot)


def parts(answer: Any) -> tuple[np.ndarray, ...]:
    return tuple(answer) if isinstance(answer, tuple) else (answer,)


@pytest.fixture(scope="module")
def planar3(package_of: Callable[[str], ModuleType]) -> ModuleType:
    package = package_of("planar3")
    if not module_of(package).headers():
        pytest.skip("needs headers of Python: apt-get install python3-dev")
    return package


@pytest.mark.parametrize("robot", ["planar3", "planar3 symbolic", "torso", TURNTABLE])
def test_both_bindings_say_the_same_to_the_bit(robot: str, package_of: Callable[[str], ModuleType]) -> None:
    package = package_of(robot)
    compiled = package.load("native")
    with without(package, headers=lambda: ()):
        through_ctypes = package.load("native")
    assert is_compiled(compiled) == bool(module_of(package).headers())
    assert not is_compiled(through_ctypes)
    draw = np.random.default_rng(0)
    for dtype, batch in (
        ("f8", ()),
        ("f8", (1,)),
        ("f4", (2, 3)),
        ("f8", (37,)),
        ("f4", (0,)),
        ("f8", (9000,)),
    ):
        motion = draw.uniform(-2.0, 2.0, (3, *batch, compiled.n)).astype(dtype)
        for _ in range(2):  # what is compiled at the first call is called otherwise from then on
            for name, call in CALLS.items():
                one, other = (call(r, *motion) for r in (compiled, through_ctypes))
                assert type(one) is type(other)
                for a, b in zip(parts(one), parts(other), strict=True):
                    assert (a.dtype, a.shape) == (b.dtype, b.shape), name
                    np.testing.assert_array_equal(a, b, err_msg=name)


@pytest.mark.parametrize("call", CALLS)
def test_zeros_and_values_are_those_of_numpy(call: str, planar3: ModuleType) -> None:
    motion = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 21, 3))
    answers = (CALLS[call](planar3.load(backend), *motion) for backend in ("native", "numpy"))
    for a, b in zip(*map(parts, answers), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(a == 0.0, b == 0.0)


NO_HEADERS = {"headers": lambda: ()}
NO_COMPILER = {"extension": lambda *_: (_ for _ in ()).throw(RuntimeError("cc failed"))}


@pytest.mark.parametrize("instead", [NO_HEADERS, NO_COMPILER], ids=["no headers", "no compiler"])
def test_without_it_ctypes_answers_silently(
    instead: dict[str, Any], planar3: ModuleType, capfd: pytest.CaptureFixture[str]
) -> None:
    with without(planar3, **instead):
        robot = planar3.load("native")
    assert not is_compiled(robot)
    robot.partial_torque(*np.ones((3, 3)))
    assert capfd.readouterr() == ("", "")


def test_no_line_of_python_runs_for_plain_arrays(planar3: ModuleType) -> None:
    robot, motion = planar3.load("native"), np.ones((3, 5, 3))
    lines: list[str] = []
    for name, call in CALLS.items():
        call(robot, *motion)  # what is compiled at the first call is called otherwise from then on
        sys.setprofile(
            lambda frame, event, _: lines.append(frame.f_code.co_name) if event == "call" else None
        )
        try:
            call(robot, *motion)
        finally:
            sys.setprofile(None)
        assert lines == ["<lambda>"], name
        lines.clear()


def test_arguments_are_taken_by_name_as_by_order(planar3: ModuleType) -> None:
    robot = planar3.load("native")
    q, qd, qdd = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 5, 3))
    expected = robot.propagation(q, qd, qdd, "gradient")
    out = tuple(np.full_like(a, np.nan) for a in expected)
    answer = robot.propagation(q, convention="gradient", out=out, qdd=qdd, qd=qd)
    for given, place, value in zip(answer, out, expected, strict=True):
        assert given is place
        np.testing.assert_array_equal(given, value)
    for name in CALLS.keys() - {"gradient"}:
        words = inspect.signature(getattr(robot, name)).parameters
        own = inspect.signature(getattr(planar3.Dynamics, name)).parameters
        assert {w: p.default for w, p in own.items() if w != "self"} == {
            w: p.default for w, p in words.items()
        }


@pytest.mark.parametrize(
    ("count", "named", "message"),
    [
        (2, {}, r"^Dynamics\.partial_torque\(\) missing 1 required positional argument: 'qdd'$"),
        (3, {"q": None}, r"^Dynamics\.partial_torque\(\) got multiple values for argument 'q'$"),
        (3, {"convention": "closing"}, r"got an unexpected keyword argument 'convention'$"),
        (5, {}, r"^Dynamics\.partial_torque\(\) takes from 4 to 5 positional arguments but 6 were given$"),
        (3, {"out": np.empty((3, 3)), "to": None}, r"got an unexpected keyword argument 'to'$"),
        (2, {"qdd": None}, r"^qdd is None; give an array"),
    ],
)
def test_wrong_arguments_are_told_as_python_tells_them(
    count: int, named: dict[str, Any], message: str, planar3: ModuleType
) -> None:
    robot, motion = planar3.load("native"), [np.ones(3)] * 3
    robot.partial_torque(*motion)  # from here on no line of Python reads right arguments
    with pytest.raises(TypeError, match=message):
        robot.partial_torque(*[np.ones(3)] * count, **named)


def test_a_call_is_pickled_with_its_robot(planar3: ModuleType) -> None:
    call = planar3.load("native").partial_torque
    motion = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 3))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(call))(*motion), call(*motion))


@pytest.mark.parametrize("batch", [(6,), (1,), ()])
@pytest.mark.parametrize("binding", ["compiled", "ctypes"])
def test_what_is_not_plain_is_read_as_by_the_other_back_ends(
    binding: str, batch: tuple[int, ...], planar3: ModuleType
) -> None:
    if binding == "compiled":
        robot = planar3.load("native")
    else:
        with without(planar3, headers=lambda: ()):
            robot = planar3.load("native")
    assert is_compiled(robot) == (binding == "compiled")
    reference = planar3.load("numpy")
    q, qd, qdd = np.random.default_rng(0).uniform(-2.0, 2.0, (3, *batch, 3))
    robot.partial_torque(q, qd, qdd)
    frozen = q.copy()
    frozen.flags.writeable = False
    unusual = {
        "strides": (np.asfortranarray(q), qd[..., ::-1][..., ::-1], qdd),
        "gaps": (q, np.stack([qd, qdd], -1)[..., 0], qdd),
        "bytes": (q.astype(">f8"), qd, qdd),
        "offset": (np.frombuffer(b"x" + q.tobytes(), np.uint8)[1:].view("f8").reshape(q.shape), qd, qdd),
        "lists": (q, qd.tolist(), qdd),
        "shapes": (q, qd.reshape(-1, 3)[0], qdd),
        "dtypes": (q, qd.astype("f4"), qdd),
        "read-only": (frozen, qd, qdd),
        "whole numbers": (q, np.ones(3, int), qdd),
    }
    unusual["broadcast"] = (*np.broadcast_arrays(np.stack([q, q]), qd, qdd[..., :1]),)
    if batch:
        unusual["subclass"] = (q.view(np.matrix), qd, qdd)
    for name, motion in unusual.items():
        given = [np.asarray(m) if name == "subclass" else m for m in motion]
        expected = reference.partial_torque(*given)
        np.testing.assert_allclose(
            robot.partial_torque(*motion), expected, rtol=1e-12, atol=1e-12, err_msg=name
        )
    for wrong, message in (
        (np.ma.masked_invalid(qd), "qd is a masked array"),
        (qd[..., :2], "qd has shape"),
        (qd.astype(complex), "qd has dtype complex128"),
    ):
        with pytest.raises((TypeError, ValueError), match=message):
            robot.partial_torque(q, wrong, qdd)


def test_nothing_is_leaked_or_freed_twice(planar3: ModuleType) -> None:
    robot = planar3.load("native")
    q, qd, qdd = motion = [np.ones((5, 3)) for _ in range(3)]
    out, one = robot.packed(*motion), robot.partial_torque(*motion)
    kinds = [type(out), type(robot.propagation(*motion))]

    def counts() -> list[int]:
        gc.collect()
        return [sys.getrefcount(o) for o in (*motion, *out, out, one, None, *kinds)]

    def rise() -> list[int]:
        before = counts()
        for _ in range(100):
            for call in CALLS.values():
                call(robot, *motion)
            robot.packed(*motion, out=out)
            robot.partial_torque(*motion, out=one)
            with pytest.raises(ValueError, match="no convention 'half'"):
                robot.propagation(*motion, "half")
            with pytest.raises(ValueError, match="qd has shape"):
                robot.partial_torque(q, qd[:, :2], qdd)
        return [abs(a - b) for a, b in zip(counts(), before, strict=True)]

    # None is everybody's: another's garbage may fall into one round, a leak of ours shows in each.
    least = [min(rises) for rises in zip(rise(), rise(), rise(), strict=True)]
    assert max(least) < 50, least


def test_what_it_is_made_of_is_looked_at(planar3: ModuleType) -> None:
    made, plain = module_of(planar3).compiled_calls(), [np.zeros(2), np.zeros(2, "f4")]
    if made is None:
        pytest.skip("needs headers of Python: apt-get install python3-dev")
    for joints, parameters in ((0, plain), (3, [plain[0][::-1], plain[1]]), (3, [plain[0], plain[1][::-1]])):
        with pytest.raises(ValueError, match="joints are one or more, parameters plain arrays"):
            made(joints, 10, *parameters, {})
    with pytest.raises(KeyError, match="packed"):
        made(3, 10, *plain, {})


def test_robots_that_nobody_holds_are_gone_and_let_go_of_what_they_held(planar3: ModuleType) -> None:
    def called() -> Any:
        robot = planar3.load("native")
        robot.packed(*np.ones((3, 3)))
        return robot

    kind = type(called().packed(*np.ones((3, 3))))
    gc.collect()
    before = sys.getrefcount(kind)
    robots = [called() for _ in range(20)]
    held = (o for robot in robots for o in (robot.backend, robot.backend.calls.constants(np.dtype("f8"))))
    gone = [weakref.ref(o) for o in held]
    robots.clear()
    gc.collect()
    assert not [reference for reference in gone if reference() is not None]
    assert sys.getrefcount(kind) < before + 10


def test_threads_call_side_by_side(planar3: ModuleType) -> None:
    robot = planar3.load("native")
    motion = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 400, 3))
    expected = robot.propagation(*motion)
    with ThreadPoolExecutor(4) as pool:
        for answer in pool.map(lambda _: robot.propagation(*motion), range(50)):
            for a, b in zip(answer, expected, strict=True):
                np.testing.assert_array_equal(a, b)


def test_threads_through_ctypes_keep_their_samples_apart(planar3: ModuleType) -> None:
    with without(planar3, headers=lambda: ()):
        robot = planar3.load("native")
    many = np.random.default_rng(0).uniform(-2.0, 2.0, (400, 3, 3))
    expected = [robot.propagation(*motion) for motion in many]
    with ThreadPoolExecutor(4) as pool:
        for answer, right in zip(pool.map(lambda m: robot.propagation(*m), many), expected, strict=True):
            for a, b in zip(answer, right, strict=True):
                np.testing.assert_array_equal(a, b)


def test_memory_that_is_not_there_is_an_error(planar3: ModuleType) -> None:
    few = np.zeros((1, 3))
    many = np.broadcast_to(few, (1 << 56, 3))
    with pytest.raises((MemoryError, ValueError)):
        planar3.load("native").propagation(many, many, many)


def test_a_compiler_for_windows_makes_no_module(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(build, "find_compiler", lambda: MinGW(("gcc",)))
    with pytest.raises(RuntimeError, match="gcc makes no modules for Python here"):
        build.extension(tmp_path / "calls.c", (), ())
