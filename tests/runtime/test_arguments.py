"""Calls of a package take for a motion every kind that leaves no doubt, and no other."""

import pickle
import re
import shutil
from collections.abc import Callable
from copy import deepcopy
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

torch = pytest.importorskip("torch")

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
MOTION = np.array([[[1, -2, 3], [2, 0, -1]], [[0, 1, 1], [-3, 2, 1]], [[2, 2, -1], [1, 0, 4]]])
"""q, qd, qdd of two samples in whole numbers, which every dtype holds exactly."""


def unaligned(a: np.ndarray) -> np.ndarray:
    room = np.zeros(a.nbytes + 1, np.uint8)
    made = room[1:].view(a.dtype).reshape(a.shape)
    made[...] = a
    return made


TENSORS: dict[str, Callable[[np.ndarray], Any]] = {
    "tensor": lambda a: torch.from_numpy(a.astype(float)),
    "tensor of integers": torch.from_numpy,
    "negated tensor": lambda a: torch._neg_view(torch.from_numpy(-a.astype(float))),
}
KINDS: dict[str, Callable[[np.ndarray], Any]] = TENSORS | {
    "array": lambda a: a.astype(float),
    "integers": lambda a: a,
    "bytes": lambda a: a.astype(np.int8),
    "list": lambda a: a.astype(float).tolist(),
    "list of integers": lambda a: a.tolist(),
    "tuple of tuples": lambda a: tuple(map(tuple, a.tolist())),
    "list of arrays": list,
    "other byte order": lambda a: a.astype(">f8"),
    "backwards": lambda a: a.astype(float)[::-1, ::-1].copy()[::-1, ::-1],
    "column after column": lambda a: np.asfortranarray(a.astype(float)),
    "read-only": lambda a: np.frombuffer(a.astype(float).tobytes()).reshape(a.shape),
    "unaligned": lambda a: unaligned(a.astype(float)),
}


def answers_tensors(backend: str, motion: Any) -> bool:
    return backend in ("torch", "autograd") or (
        backend == "native" and any(torch.is_tensor(part) for part in motion)
    )


def expected(package: ModuleType) -> Any:
    return package.load("numpy").packed(*MOTION.astype(float))


def check(package: ModuleType, backend: str, motion: Any, dtype: str = "float64") -> None:
    answer = package.load(backend).packed(*motion)
    for values, exact in zip(answer, expected(package), strict=True):
        assert torch.is_tensor(values) == answers_tensors(backend, motion)
        assert str(values.dtype).removeprefix("torch.") == dtype
        tolerance = 1e-13 if dtype == "float64" else 1e-5
        np.testing.assert_allclose(np.asarray(values), exact, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("backend", BACKENDS)
def test_whatever_reads_as_numbers_is_taken(
    backend: str, kind: str, package_of: Callable[[str], ModuleType]
) -> None:
    package, of = package_of("planar3"), KINDS[kind]
    check(package, backend, [of(part) for part in MOTION])
    q, qd, qdd = MOTION
    check(package, backend, [of(q), qd.astype(float), qdd.tolist()])


@pytest.mark.parametrize(
    ("dtypes", "result"),
    [
        (("float32", "list", "int64"), "float32"),
        (("list", "int32", "float32"), "float32"),
        (("float32", "float64", "list"), "float64"),
        (("float32", "float64", "float64"), "float64"),
        (("int8", "float64", "float32"), "float64"),
        (("int64", "list", "uint8"), "float64"),
    ],
)
@pytest.mark.parametrize("tensors", [False, True])
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_has_no_precision_goes_along_with_what_has(
    backend: str, tensors: bool, dtypes: tuple[str, ...], result: str, package_of: Callable[[str], ModuleType]
) -> None:
    def cast(part: np.ndarray, dtype: str) -> Any:
        if dtype == "list":
            return part.astype(float).tolist()
        return torch.from_numpy(part.astype(dtype)) if tensors else part.astype(dtype)

    whole = np.abs(MOTION)
    motion = [cast(part, dtype) for part, dtype in zip(whole, dtypes, strict=True)]
    answer = package_of("planar3").load(backend).packed_torque(*motion)
    assert str(answer.dtype).removeprefix("torch.") == result
    exact = package_of("planar3").load("numpy").packed_torque(*whole.astype(float))
    np.testing.assert_allclose(np.asarray(answer), exact, rtol=1e-5 if result == "float32" else 1e-13)


@pytest.mark.parametrize("backend", ["torch", "autograd", pytest.param("native", marks=needs_compiler)])
def test_gradients_flow_beside_arrays_and_lists(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = torch.from_numpy(MOTION.astype(float))
    leaf = q.clone().requires_grad_()
    array = qd.numpy().copy()
    answer = robot.inverse_dynamics(leaf, array, qdd.tolist()).square().sum()
    array[...] = np.nan  # what the user does with it afterwards is of no account
    answer.backward()
    again = q.clone().requires_grad_()
    robot.inverse_dynamics(again, qd, qdd).square().sum().backward()
    assert leaf.grad is not None
    torch.testing.assert_close(leaf.grad, again.grad)


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "booleans": (lambda: np.ones(3, bool), "qd has dtype bool; give float32, float64 or integers"),
    "list of booleans": (lambda: [True, False, True], "qd has dtype bool; give"),
    "complex": (lambda: np.ones(3, complex), "qd has dtype complex128; give"),
    "half": (lambda: np.ones(3, np.float16), "qd has dtype float16; give"),
    "long": (lambda: np.ones(3, np.longdouble), "qd has dtype (longdouble|float128|float96); give"),
    "half of torch": (lambda: torch.ones(3, dtype=torch.float16), "qd has dtype float16; give"),
    "words": (lambda: "abc", r"qd has dtype str\d+; give"),
    "nothing": (
        lambda: None,
        r"^qd is None; give an array, a tensor or a list of numbers$",
    ),
    "a gap": (lambda: [1.0, None, 2.0], "qd has dtype object; give"),
    "ragged": (lambda: [[1.0, 2.0], [1.0]], "qd does not read as an array: .*inhomogeneous"),
    "masked": (lambda: np.ma.masked_array(np.ones(3), [0, 1, 0]), "qd is a masked array; fill its gaps"),
    "tensors": (lambda: [torch.tensor(1.0)] * 3, r"qd is a list of tensors; join them with torch\.stack"),
}


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_leaves_a_doubt_is_refused_by_name(
    backend: str, kind: str, package_of: Callable[[str], ModuleType]
) -> None:
    make, message = REFUSED[kind]
    with pytest.raises((TypeError, ValueError), match=message) as error:
        package_of("planar3").load(backend).partial_torque(np.ones(3), make(), np.ones(3))
    assert "\n" not in str(error.value)


def test_arrays_refuse_tensors_that_would_lose_something(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("planar3").load("numpy")
    one = np.ones(3)
    leaf = torch.ones(3, dtype=torch.float64, requires_grad=True)
    with pytest.raises(TypeError, match=r"qd requires a gradient, which arrays do not carry; load torch, or"):
        robot.partial_torque(one, leaf, one)
    with torch.no_grad():
        assert isinstance(robot.partial_torque(one, leaf, one), np.ndarray)
    with pytest.raises(TypeError, match=r"qdd lies on meta; load torch, or pass qdd\.cpu\(\)"):
        robot.partial_torque(one, one, torch.ones(3, device="meta"))
    with pytest.raises(TypeError, match=r"q does not read as an array: .*BFloat16"):
        robot.partial_torque(torch.ones(3, dtype=torch.bfloat16), one, one)


def test_what_needs_numbers_says_so_inside_of_transformations(
    package_of: Callable[[str], ModuleType],
) -> None:
    robot, q = package_of("planar3").load("torch"), torch.ones(2, 3, dtype=torch.float64)
    told = r"^this needs the numbers of q, which torch\.func, .* hide; call it outside of them, or take"
    with pytest.raises(TypeError, match=told):
        torch.vmap(lambda each: robot.simulate(each, each, [0.0, 0.01]).q)(q)
    with pytest.raises(TypeError, match=told):
        torch.func.jacrev(lambda tau: robot.simulate(q[0], q[0], [0.0, 0.01], tau).q)(q[0])


NOT_DENSE: dict[str, tuple[Callable[[], Any], str]] = {
    "sparse": (
        lambda: torch.ones(2, 3, dtype=torch.float64).to_sparse(),
        r"has the layout torch\.sparse_coo; pass \w+\.to_dense\(\)",
    ),
    "nested": (
        lambda: torch.nested.nested_tensor([torch.ones(3), torch.ones(3)]),
        r"is a nested tensor; join its parts with torch\.stack or torch\.cat",
    ),
}


@pytest.mark.filterwarnings("ignore:The PyTorch API of nested tensors:UserWarning")
@pytest.mark.parametrize("kind", NOT_DENSE)
@pytest.mark.parametrize("backend", BACKENDS)
def test_tensors_that_are_not_dense_are_refused_by_name(
    backend: str, kind: str, package_of: Callable[[str], ModuleType]
) -> None:
    make, message = NOT_DENSE[kind]
    robot, q, odd = package_of("planar3").load(backend), torch.ones(2, 3, dtype=torch.float64), make()
    for motion, name in (((odd, odd, odd), "q"), ((q, odd, q), "qd"), ((q, q.numpy(), odd), "qdd")):
        with pytest.raises(TypeError, match=f"^{name} {message}$"):
            robot.partial_torque(*motion)


@needs_compiler
@pytest.mark.parametrize(("kind", "axes", "names"), [("tensor", 65, "q, qd, qdd"), ("array", 34, "qd")])
def test_more_axes_than_arrays_have_are_named(
    kind: str, axes: int, names: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load("native")
    motion = [torch.ones(*[1] * (count - 1), 3, dtype=torch.float64) for count in (1, axes, 1)]
    given = motion if kind == "tensor" else [part.numpy() for part in motion]
    message = (
        rf"^{names}: {axes} axes are too many for this back end; join .*, as q\w*.reshape\(-1, 3\) does$"
    )
    with pytest.raises(ValueError, match=message):
        robot.partial_torque(*given)
    assert robot.partial_torque(*(part.reshape(-1, 3) for part in given)).shape == (1, 3, 3)


def test_a_tensor_of_more_axes_than_numpy_has_is_named(package_of: Callable[[str], ModuleType]) -> None:
    motion = [torch.ones(*[1] * (count - 1), 3, dtype=torch.float64) for count in (1, 65, 1)]
    with pytest.raises(ValueError, match=r"^qd: 65 axes are too many for this back end; join .* qd\.reshape"):
        package_of("planar3").load("numpy").partial_torque(*motion)


@pytest.mark.parametrize("tensors", [False, True])
@pytest.mark.parametrize("backend", BACKENDS)
def test_shapes_that_do_not_go_together_are_named(
    backend: str, tensors: bool, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    q, qd, qdd = np.ones((4, 3)), np.ones((5, 3)), np.ones(3)
    motion = [torch.from_numpy(part) for part in (q, qd, qdd)] if tensors else [q, qd, qdd]
    shapes = r"q \(4, 3\), qd \(5, 3\), qdd \(3,\)"
    message = f"^the shapes do not go together: {shapes}; before the last axis, 3 for the joints, axes must"
    with pytest.raises(ValueError, match=message):
        robot.partial_torque(*motion)
    with pytest.raises(ValueError, match=r"^the shapes do not go together: q \(4, 3\), qd \(5, 3\); before"):
        robot.coefficients(*motion[:2])
    with pytest.raises(ValueError, match=r"qdd has shape \(\); its last axis must be 3, one for each joint"):
        robot.partial_torque(motion[2], motion[2], 1.0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_nan_is_found_where_it_was_asked_for(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    package = package_of("planar3")
    robot = package.load(backend, check_finite=True)
    q, qd, qdd = MOTION.astype(float)
    many = np.tile(qd, (2, 1, 1))
    many[1, 0, 2] = np.inf
    gap = [1.0, float("nan"), 0.0]
    for call in (robot.packed, robot.packed_torque, robot.partial_torque, robot.inverse_dynamics):
        with pytest.raises(ValueError, match=r"^qdd is nan for joint 'joint2'$"):
            call(q, qd, gap)
    with pytest.raises(ValueError, match=r"^qd is inf at sample 1, 0 for joint 'joint3'$"):
        robot.coefficients(q, many)
    with pytest.raises(ValueError, match=r"^qd is -inf at sample 1 for joint 'joint3'$"):
        robot.propagation(q, -many[1, ::-1], qdd)
    with pytest.raises(ValueError, match=r"^q is nan for joint 'joint2'$"):
        robot.position_gradient(torch.tensor(gap), qd, qdd)
    with pytest.raises(ValueError, match=r"^q is nan for joint 'joint2'$"):
        robot.masked(gap, qd, qdd, np.ones((3, 3)))
    np.testing.assert_array_equal(
        robot.packed_torque(q, qd, qdd), package.load(backend).packed_torque(q, qd, qdd)
    )
    assert np.isnan(np.asarray(package.load(backend).packed_torque(q, qd, gap))).any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_repr_tells_the_robot(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    assert repr(package_of("planar3").load(backend)) == f"<planar3 on {backend}: 3 joints, 3 links>"
    symbolic = package_of("planar3 symbolic")
    count = len(symbolic.parameters)
    assert repr(symbolic.load(backend)) == f"<planar3 on {backend}: 3 joints, 3 links, {count} parameters>"


@pytest.mark.parametrize("backend", BACKENDS)
def test_whether_numbers_are_looked_at_may_be_set(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    gap, rest = np.full(3, np.nan), np.ones(3)
    for _ in range(2):
        assert np.isnan(np.asarray(robot.partial_torque(gap, rest, rest))).any()
        robot.check_finite = True
        for one in (robot, deepcopy(robot)):
            with pytest.raises(ValueError, match="q is nan"):
                one.partial_torque(gap, rest, rest)
        robot.check_finite = False


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_copied_robot_still_looks_for_nan(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = deepcopy(package_of("planar3").load(backend, check_finite=True))
    with pytest.raises(ValueError, match="q is nan"):
        robot.packed(np.full(3, np.nan), np.ones(3), np.ones(3))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("batch", [(), (2,), (2, 3), (0,)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_field_that_a_robot_has_none_of_is_empty_but_an_array(
    backend: str, batch: tuple[int, ...], dtype: str, package_of: Callable[[str], ModuleType]
) -> None:
    part = np.ones((*batch, 3), dtype)
    answer = package_of("planar3").load(backend).packed(part, part, part)
    assert tuple(answer.velocity_excess.shape) == (*batch, 0)
    assert str(answer.velocity_excess.dtype).removeprefix("torch.") == dtype
    assert torch.is_tensor(answer.velocity_excess) == (backend in ("torch", "autograd"))


REST = np.zeros(3), np.zeros(3)


@pytest.fixture(scope="module")
def planar3_again(
    directory_of: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory
) -> ModuleType:
    """Return the same package in another place."""
    return import_package(
        shutil.copytree(directory_of("planar3"), tmp_path_factory.mktemp("again") / "planar3")
    )


def test_constraints_of_another_package_are_of_another_robot(
    package_of: Callable[[str], ModuleType], planar3_again: ModuleType
) -> None:
    own, other = (package.load("numpy") for package in (package_of("planar3"), planar3_again))
    held = other.constrained(
        contacts=[planar3_again.Contact("link3", "point", (0.25, 0.0, 0.0))], at=[0.3, 0.5, 0.7]
    )
    with pytest.raises(ValueError, match=r"^constraints are of another robot than this planar3 on numpy"):
        own.induced_accelerations(*REST, REST[0], constraints=held)


def test_a_record_that_is_no_target_is_refused(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of("planar3")
    controller = package.load("numpy").partial_impedance()
    with pytest.raises(
        TypeError, match=r"^target is Natural\(scale=1.0, plus=None\); give positions \(\.\.\., n\)"
    ):
        controller(*REST, package.Natural())


def test_of_each_class_there_is_one(package_of: Callable[[str], ModuleType], tmp_path: Path) -> None:
    """A package that carries its runtime has the library's classes, too, once linkwise has opened it."""
    write_package(generate(read_system("planar2"), ["numpy"], vendor_runtime=True), tmp_path / "planar2")
    packages = package_of("planar3"), package_of("torso"), import_package(tmp_path / "planar2")
    for name in ("AppliedLoad", "Bodies", "Contact", "FrameImpedance", "Natural", "Target"):
        assert len({getattr(package, name) for package in packages}) == 1, name


def test_what_another_copy_of_the_runtime_made_is_told_apart(
    package_of: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    write_package(generate(read_system("planar2"), ["numpy"], vendor_runtime=True), tmp_path / "alone")
    with pytest.MonkeyPatch.context() as patch:  # by Python itself, which knows of no library
        patch.syspath_prepend(tmp_path)
        other = import_module("alone")
    package = package_of("planar3")
    robot, told = (
        package.load("numpy"),
        r"of alone, which is another copy of the runtime than this robot's; give",
    )
    load, contact = other.AppliedLoad(0, [0, 0, 1.0]), other.Contact(0)
    for loads, place in ((load, "loads"), ([load], r"loads\[0\]"), ([[load]], r"loads\[0\]")):
        with pytest.raises(TypeError, match=rf"^{place} is the AppliedLoad {told}"):
            robot.induced_accelerations(*REST, REST[0], loads=loads)
    with pytest.raises(TypeError, match=rf"^contacts\[0\] is the Contact {told}"):
        robot.constrained(contacts=[contact])
    with pytest.raises(TypeError, match=rf"^frame is the FrameImpedance {told}"):
        robot.partial_impedance(frame=other.FrameImpedance(0))
    with pytest.raises(TypeError, match=r"^inertia is the Natural of alone, which is another copy"):
        robot.partial_impedance(inertia=other.Natural(2.0))
    with pytest.raises(TypeError, match=rf"^target is the Target {told}"):
        robot.partial_impedance()(*REST, other.Target(q=REST[0]))


@pytest.mark.parametrize("backend", [b for b in BACKENDS if b != "autograd"])
def test_no_samples_have_regressors_of_no_rows(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    robot, none = package_of("planar3").load(backend), np.zeros((0, 3))
    assert robot.regressor(none, none, none).shape == (0, 3, 3, 10)
    c2, _, g = robot.coefficient_regressors(none, none)
    assert (c2.shape, g.shape) == ((0, 3, 3, 3, 10), (0, 3, 3, 10))


Vectors = dict[str, tuple[tuple[int, ...], Callable[[Any, Any], Any]]]


def calls_beside(package: ModuleType, robot: Any) -> Vectors:
    """Return, by the name of what stands beside q, its own shape and a call that takes both."""
    frame, Target = robot.kinematics.frames[-1], package.Target
    held = robot.partial_impedance(frame=package.FrameImpedance(frame, stiffness=1.0, rows=("x", "y", "rz")))
    free = robot.partial_impedance(frame=package.FrameImpedance(frame, rows=("x", "y", "rz")))

    def load(a: Any) -> list[Any]:
        return [[package.AppliedLoad(frame, a)]]

    return {
        "point": ((3,), lambda q, a: robot.kinematics.velocity(q, q, frame, point=a)),
        "force": ((3,), lambda q, a: robot.kinematics.load_torque(q, frame, a)),
        "at": ((3,), lambda q, a: robot.kinematics.load_torque(q, frame, [1.0, 2.0, 3.0], at=a)),
        "loads[0][0].force": ((3,), lambda q, a: robot.induced_accelerations(q, q, q, loads=load(a)).loads),
        "target.velocity": ((6,), lambda q, a: free(q, q, Target(velocity=a))),
        "target.pose": ((4, 4), lambda q, a: held(q, q, Target(pose=a))),
        "tau": ((3,), lambda q, a: robot.simulate(q, q, [0.0, 0.01], tau=a).q[-1]),
        "external": ((3,), lambda q, a: free(q, q, external=a)),
    }


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_stands_beside_motion_is_taken_by_the_same_rule(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    robot, known = package.load(backend), package.load("numpy")
    q = np.array([[0.3, 0.5, 0.7], [0.4, 0.6, 0.8]])
    whole = calls_beside(package, known)
    for name, (shape, call) in calls_beside(package, robot).items():
        turned = known.kinematics.pose(q + 0.1, known.kinematics.frames[-1])
        given = turned if shape == (4, 4) else np.random.default_rng(2).uniform(-0.3, 0.3, (2, *shape))
        expected = whole[name][1](q, given)
        for first, second in (("f4", "f8"), ("f8", "f4")):
            found = call(q.astype(first), given.astype(second))
            assert (str(found.dtype).removeprefix("torch."), name) == ("float64", name)
            np.testing.assert_allclose(np.asarray(found), expected, atol=1e-5)
        listed = np.asarray(call(q.astype("f4"), given.tolist()))
        assert (listed.dtype, name) == (np.float32, name)
        one = np.asarray(call(q[0], given))  # one motion beside several
        np.testing.assert_allclose(one, whole[name][1](np.stack([q[0], q[0]]), given), atol=1e-12)
        tensor = torch.tensor(given, requires_grad=True)
        if backend == "numpy":
            with pytest.raises(
                TypeError, match=f"^{re.escape(name)} requires a gradient, which arrays do not"
            ):
                call(q, tensor)
        else:
            call(q, tensor).sum().backward()
            assert float(abs(tensor.grad).sum()) > 0.0, name


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_wrong_beside_motion_is_told_by_name(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    robot, q = package.load(backend, check_finite=True), np.full((2, 3), 0.5)
    for name, (shape, call) in calls_beside(package, robot).items():
        told, gap = re.escape(name), np.zeros((2, *shape))
        with pytest.raises(TypeError, match=f"^{told} has dtype bool; give float32, float64 or integers$"):
            call(q, np.ones((2, *shape), bool))
        with pytest.raises(ValueError, match="^the shapes do not go together: .*" + told + r" \(5, "):
            call(q, np.zeros((5, *shape)))
        with pytest.raises(ValueError, match=f"^{told} has shape .*; its last ax[ie]s must be {shape[0]}"):
            call(q, np.zeros(2))
        gap[1, ..., 1] = np.nan
        with pytest.raises(ValueError, match=f"^{told} is nan at sample 1 (in entry|for joint) "):
            call(q, gap)
    with pytest.raises(ValueError, match=r"^the mask is nan in entry 1, 2$"):
        robot.masked(q, q, q, [[1.0, 0, 0], [0, 0, np.nan], [0, 0, 0]])


def test_what_is_given_along_a_motion_is_in_its_precision(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of("planar3")
    robot, q = package.load("numpy"), np.full(3, 0.5, np.float32)
    load = package.AppliedLoad(robot.kinematics.frames[-1], np.array([1.0, 2.0, 0.0]))
    fixed = robot.simulate(
        q, q, [0.0, 0.1], tau=np.ones(3, np.float32), loads=[load._replace(force=[1, 2, 0])]
    )
    found = robot.simulate(q, q, [0.0, 0.1], tau=lambda t, q, qd: np.ones(3), loads=lambda t, q, qd: [load])
    assert found.q.dtype == fixed.q.dtype == np.float32
    np.testing.assert_array_equal(found.q, fixed.q)


@pytest.mark.parametrize("backend", BACKENDS)
def test_kinematics_and_controllers_are_copied_with_their_robot(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    robot, q = package.load(backend), np.full((2, 3), 0.5)
    frame = package.FrameImpedance(robot.kinematics.frames[-1], stiffness=1.0, rows=("x", "y"))
    held, pose = robot.partial_impedance(frame=frame), robot.kinematics.pose(q + 0.1, frame.frame)
    cancelled = robot.cancel({(None, None, "joint2", 1)}, friction_width=0.1)
    for copied in (deepcopy, lambda one: pickle.loads(pickle.dumps(one))):
        for one, made in (
            (robot.kinematics, lambda one: one.pose(q, -1 + len(one.frames))),
            (held, lambda one: one(q, q, package.Target(pose=pose))),
            (cancelled, lambda one: one(q, q)),
        ):
            np.testing.assert_array_equal(np.asarray(made(copied(one))), np.asarray(made(one)))


def test_threads_are_set_where_there_are_some_alone(package_of: Callable[[str], ModuleType]) -> None:
    for backend in ("numpy", "torch"):
        with pytest.raises(AttributeError, match=f"^{backend} has no threads of its own to set; native has$"):
            package_of("planar3").load(backend).backend.threads = 2


@pytest.mark.parametrize("kind", ["float32", "float64", "int64"])
@pytest.mark.parametrize("given", ["list", "array", "tensor"])
def test_a_compiler_takes_what_stands_beside_motion_as_python_does(
    kind: str, given: str, package_of: Callable[[str], ModuleType]
) -> None:
    kinematics = package_of("planar3").load("torch").kinematics
    frame, q = kinematics.frames[-1], torch.tensor([1, 2, 3]).to(getattr(torch, kind))
    point: Any = np.array([0.1, 0.2, 0.3])
    point = {"list": point.tolist(), "array": point, "tensor": torch.from_numpy(point)}[given]
    expected = kinematics.jacobian(q, frame, point)
    kinematics.jacobian(q.float(), frame)  # no compiler traces how tables are made
    torch._dynamo.reset()
    found = torch.compile(lambda q: kinematics.jacobian(q, frame, point), backend="eager")(q)
    assert found.dtype == expected.dtype
    torch.testing.assert_close(found, expected)


@pytest.mark.parametrize("batch", [(3,), (2, 3)])
@pytest.mark.parametrize("field", ["masses", "centres", "inertias"])
def test_symbols_of_bodies_of_which_one_quantity_differs_by_sample_are_each_ones_own(
    field: str,
    batch: tuple[int, ...],
    package_of: Callable[[str], ModuleType],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    package = package_of("planar3")
    draw, own = np.random.default_rng(1), package.bodies()
    q, scale = draw.uniform(-1.0, 1.0, (*batch, 3)), draw.uniform(0.9, 1.1, batch)
    one = getattr(own, field)
    several = own._replace(**{field: scale.reshape(*batch, *[1] * one.ndim) * one})
    monkeypatch.setattr("linkwise_runtime.answers.answers.AT_ONCE", 100)  # as many samples, and one at a time
    found = package.load("numpy", bodies=several).christoffel(q)
    for at in np.ndindex(batch):
        alone = package.load("numpy", bodies=own._replace(**{field: scale[at] * one}))
        np.testing.assert_allclose(found[at], alone.christoffel(q[at]), atol=1e-13)


@pytest.mark.parametrize(("samples", "batch"), [((3,), ()), ((3, 3), (3,)), ((3, 1), (2,))])
def test_symbols_of_bodies_of_other_samples_than_the_motions_are_refused(
    samples: tuple[int, ...], batch: tuple[int, ...], package_of: Callable[[str], ModuleType]
) -> None:
    """Three unit velocities stand before the samples: so many bodies would be laid along them."""
    package = package_of("planar3")
    own = package.bodies()
    robot = package.load(
        "numpy", kernel="rule", bodies=own._replace(masses=np.ones((*samples, 1)) * own.masses)
    )
    told = re.escape(f"the motion has samples of shape {batch}")
    for call in (robot.mass_matrix, robot.christoffel):
        with pytest.raises(ValueError, match=told):
            call(np.ones((*batch, 3)))
