"""The vectorised rule: values, bodies as arguments, transformations, and how it is chosen."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import relative_error
from helpers.urdf_text import chain, joint, mimic
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.arrays.backend import Crossing, largest_batch

from runtime.test_parameters import TOML

torch = pytest.importorskip("torch")

BACKENDS = ("numpy", "torch")
CALLS = ("partial_torque", "position_gradient", "inverse_dynamics")
BODIES = ("masses", "centres", "inertias")


def motion_of(backend: str, n: int, *batch: int, dtype: str = "float64") -> list[Any]:
    arrays = np.random.default_rng(7).uniform(-2.0, 2.0, (3, *batch, n)).astype(dtype)
    return list(arrays) if backend == "numpy" else [torch.from_numpy(a) for a in arrays]


WAYS = {"in matrices": (True, False), "samples innermost": (False, False), "fused": (False, True)}
"""Ways in which the rule computes: for few samples, for many, and for a compiler, here without one."""
in_every_way = pytest.mark.parametrize("way", WAYS)


def told(robot: Any, way: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The robot, computing in a way of these."""
    few, fuses = WAYS[way]
    monkeypatch.setattr(type(robot.backend), "few", lambda self, samples, links: few)
    monkeypatch.setattr(type(robot.backend), "fuses", fuses)
    return robot


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """An arm with a massless body, formulas and a parameter for every number."""
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.toml").write_text(TOML)
    system = read_system(folder / "arm.toml", Options("symbolic"))
    write_package(generate(system, BACKENDS, "made"), folder / "made")
    return import_package(folder / "made")


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("each", [False, True])
@in_every_way
def test_the_rule_takes_parameters_one_for_all_or_one_a_sample(
    backend: str, each: bool, way: str, arm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    share = np.array([0.9, 1.0, 1.05]) if each else np.float64(1.05)
    given = {name: value * share for name, value in arm.parameters.items()}
    motion = motion_of(backend, 3, 3)
    rule, straight = (
        arm.load(backend, given, allow_unphysical=True, kernel=kernel) for kernel in ("rule", "straight")
    )
    told(rule, way, monkeypatch)
    for call in CALLS:
        assert relative_error(getattr(rule, call)(*motion), getattr(straight, call)(*motion)) <= 1e-14


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("batch", [(0,), (2, 0)], ids=str)
@in_every_way
def test_parameters_and_bodies_may_be_those_of_no_samples(
    backend: str, batch: tuple[int, ...], way: str, arm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, own = motion_of(backend, 3, *batch), arm.bodies()
    none = [np.broadcast_to(a, (*batch, *a.shape)) for a in own]
    given = {name: np.full(batch, value) for name, value in arm.parameters.items()}
    robots = [arm.load(backend, given, allow_unphysical=True, kernel="rule")]
    each = [none, *([*own[:i], none[i], *own[i + 1 :]] for i in range(len(BODIES)))]
    robots += [arm.load(backend, bodies=arm.Bodies(*bodies)) for bodies in each]
    for robot in robots:
        told(robot, way, monkeypatch)
        for call in CALLS:
            value, expected = getattr(robot, call)(*motion), getattr(arm.load(backend), call)(*motion)
            assert (value.shape, value.dtype) == (expected.shape, expected.dtype)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("parameters", ["none", "one a sample"])
def test_large_batches_in_pieces_are_what_single_samples_are(
    backend: str,
    parameters: str,
    arm: ModuleType,
    package_of: Callable[[str], ModuleType],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if parameters == "none":
        robot = package_of("torso").load(backend, kernel="rule")
    else:
        given = {name: value * np.linspace(0.9, 1.05, 23) for name, value in arm.parameters.items()}
        robot = arm.load(backend, given, allow_unphysical=True, kernel="rule")
    told(robot, "samples innermost", monkeypatch)
    q, qd, qdd = motion_of(backend, robot.n, 23)

    def answers() -> list[Any]:
        regressors = robot.regressor(q, qd, qdd), *robot.coefficient_regressors(q, qd)
        return [*robot.packed(q, qd, qdd), *robot.energy(q, qd), *regressors]

    whole = answers()
    monkeypatch.setattr(type(robot.backend), "chunk", lambda self, motion, most: 5)
    for piece, one in zip(answers(), whole, strict=True):
        if one.shape[-1]:
            assert relative_error(piece, one) <= 1e-15


def test_joints_that_follow_one_coordinate_rest_in_numbers(tmp_path: Path) -> None:
    """Entries of theirs are sums, of which some have nothing to add; weight does not turn what is upright."""
    upright = joint("ab", "a", "b", rpy="0 0 0", axis="0 0 1")
    follows = joint("bc", "b", "c", inner=mimic("ab", 0.5))
    (tmp_path / "arm.urdf").write_text(chain(upright, follows, joint("cd", "c", "d")))
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    robot = import_package(tmp_path / "arm").load("numpy", kernel="rule")
    for samples in (1, 300):
        q, qd, qdd = motion_of("numpy", robot.n, samples)
        for part in robot.packed(q, 0.0 * qd, 0.0 * qdd):
            assert np.isfinite(part).all()


def test_batches_beyond_the_cache_are_what_single_samples_are(
    package_of: Callable[[str], ModuleType],
) -> None:
    robot = package_of("planar3").load("numpy", kernel="rule")
    frame, motion = robot.kinematics.frames[-1], motion_of("numpy", robot.n, 60_000)

    def accelerated(*at: Any) -> Any:
        return robot.kinematics.acceleration(*at, frame)

    for call, samples in ((robot.regressor, 9_000), (accelerated, 60_000)):
        whole = call(*(a[:samples] for a in motion))
        for at in (0, 4_321, samples - 1):
            assert relative_error(whole[at], call(*(a[at] for a in motion))) <= 1e-14


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("batch", [(), (2, 3), (0,)])
@in_every_way
def test_the_rule_keeps_dtype_and_shape(
    backend: str,
    dtype: str,
    batch: tuple[int, ...],
    way: str,
    package_of: Callable[[str], ModuleType],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, other = (package_of("puma560").load(backend, kernel=kernel) for kernel in ("rule", "straight"))
    told(robot, way, monkeypatch)
    motion = motion_of(backend, 6, *batch, dtype=dtype)
    for call in ("partial_torque", "position_gradient"):
        value, expected = getattr(robot, call)(*motion), getattr(other, call)(*motion)
        assert str(value.dtype).removeprefix("torch.") == dtype
        assert value.shape == expected.shape
        if value.size if backend == "numpy" else value.numel():
            assert relative_error(value, expected) <= (1e-5 if dtype == "float32" else 1e-14)


def test_slopes_by_bodies_are_pinocchios_regressor(package_of: Callable[[str], ModuleType]) -> None:
    """Torques are linear in m, m c and the inertia about the frame's origin: d tau = Y d pi."""
    pin = pytest.importorskip("pinocchio")
    from numeric.oracle_models import puma560

    package, model = package_of("puma560"), puma560()
    own = package.bodies()
    motion = motion_of("torch", 6)
    regressor = pin.computeJointTorqueRegressor(model, model.createData(), *(a.numpy() for a in motion))

    def standard(masses: Any, centres: Any, inertias: Any) -> Any:
        square = (centres**2).sum(-1)[:, None, None] * torch.eye(3)
        about = inertias + masses[:, None, None] * (square - centres[:, :, None] * centres[:, None])
        entries = [about[:, i, k] for i, k in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
        first = masses[:, None] * centres
        return torch.stack([masses, *first.unbind(-1), *entries], -1).reshape(-1)

    def torque(*bodies: Any) -> Any:
        robot = package.load("torch", bodies=package.Bodies(*bodies))
        return robot.inverse_dynamics(*motion)

    bodies = tuple(torch.from_numpy(a) for a in own)
    assert relative_error(torque(*bodies), regressor @ standard(*bodies).numpy()) <= 1e-13
    slopes = torch.autograd.functional.jacobian(torque, bodies)
    outlines = torch.autograd.functional.jacobian(standard, bodies)
    for slope, outline in zip(slopes, outlines, strict=True):
        expected = np.tensordot(regressor, outline.numpy(), 1)
        if expected.ndim == 4:  # of an inertia the symmetric part counts
            expected = 0.5 * (expected + expected.swapaxes(-1, -2))
        assert relative_error(slope, expected) <= 1e-13


@pytest.mark.parametrize("backend", BACKENDS)
@in_every_way
def test_bodies_may_differ_from_sample_to_sample(
    backend: str, way: str, package_of: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    package = package_of("torso")
    motion = motion_of(backend, told(package.load(backend), way, monkeypatch).n, 4)
    scale = np.array([0.5, 1.0, 2.0, 3.0])
    own = package.bodies()
    bodies = package.Bodies(
        scale[:, None] * own.masses, own.centres, scale[:, None, None, None] * own.inertias
    )
    tau = np.asarray(package.load(backend, bodies=bodies).partial_torque(*motion))
    plain = np.asarray(package.load(backend).partial_torque(*motion))
    assert relative_error(tau, scale[:, None, None] * plain) <= 1e-14


WRONG = {
    "no bodies": ([1.0], TypeError, r"bodies is list; give Bodies\(masses, centres, inertias\), such as"),
    "none": (
        {"masses": None},
        TypeError,
        r"bodies.masses is None; give an array or a tensor of shape \(3,\)",
    ),
    "count": ({"masses": np.ones(2)}, ValueError, r"bodies.masses has shape \(2,\); it must be \(3,\)"),
    "axes": (
        {"inertias": np.ones((3, 3))},
        ValueError,
        r"bodies.inertias has shape \(3, 3\); it must be \(3, 3, 3\)",
    ),
    "text": ({"centres": "here"}, TypeError, "bodies.centres has dtype str128; give float32, float64 or int"),
}


@pytest.mark.parametrize("case", WRONG)
@pytest.mark.parametrize("backend", BACKENDS)
def test_wrong_bodies_are_refused_by_name(
    backend: str, case: str, package_of: Callable[[str], ModuleType]
) -> None:
    given, error, message = WRONG[case]
    package = package_of("planar3")
    bodies = package.bodies()._replace(**given) if isinstance(given, dict) else given
    with pytest.raises(error, match=message):
        package.load(backend, bodies=bodies)


@pytest.mark.parametrize("backend", BACKENDS)
def test_bodies_in_arrays_are_copied_and_may_be_read_only(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    given = package.Bodies(*(a.copy() for a in package.bodies()))
    for a in given:
        a.flags.writeable = False
    robot, motion = package.load(backend, bodies=given), np.ones((3, 3))
    before = np.asarray(robot.partial_torque(*motion)).copy()
    for a in given:
        a.flags.writeable = True
        a *= 2.0
    np.testing.assert_array_equal(np.asarray(robot.partial_torque(*motion)), before)


@pytest.mark.parametrize("backend", BACKENDS)
def test_bodies_of_other_samples_than_the_motions_are_refused(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    robot = package.load(backend, bodies=package.bodies()._replace(masses=np.ones((5, 3))))
    with pytest.raises(
        ValueError, match=r"'bodies.masses' has shape \(5,\), the motion has samples of shape"
    ):
        robot.partial_torque(*motion_of(backend, 3, 4))


def test_a_kernel_is_chosen_by_name(package_of: Callable[[str], ModuleType]) -> None:
    package, energies = (
        package_of("planar3"),
        package_of(str(Path(__file__).parents[1] / "data/turntable.py")),
    )
    with pytest.raises(ValueError, match="no kernel 'loop'; choose one of auto, straight, rule"):
        package.load("numpy", kernel="loop")
    with pytest.raises(ValueError, match="closed forms hold the package's own bodies; take kernel='rule'"):
        package.load("torch", kernel="straight", bodies=package.bodies())
    with pytest.raises(ValueError, match="autograd has no kernels to choose from; leave kernel out"):
        package.load("autograd", kernel="rule")
    with pytest.raises(ValueError, match="autograd computes with the package's own bodies; load numpy or"):
        package.load("autograd", bodies=package.bodies())
    with pytest.raises(ValueError, match="this package is of energies, which have closed forms alone"):
        energies.load("numpy", kernel="rule")
    with pytest.raises(ValueError, match="this package is of energies, which have no bodies"):
        energies.load("numpy", bodies=package.bodies())
    assert not hasattr(energies, "bodies")


@pytest.mark.parametrize("backend", BACKENDS)
def test_auto_takes_what_the_table_says(
    backend: str, package_of: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    package = package_of("planar3")
    kind = type(package.load(backend).backend)
    module = __import__(kind.__module__, fromlist=["CROSSINGS"])
    operations = sum(link.OPERATIONS["torque"] for link in package.load(backend).backend.links)
    rows = ((10, 0), (operations, 4), (operations + 1, 99))
    monkeypatch.setattr(module, "CROSSINGS", {"torque": Crossing(operations, rows)})
    robot = package.load(backend)
    taken: list[int] = []

    def counted(self: Any, space: Any, motion: Any, p: Any, bodies: Any) -> Any:
        taken.append(len(motion[0]))
        return space.zeros(motion[0], 6)

    monkeypatch.setattr(type(robot.backend.rule), "torque", counted)
    for samples in (3, 4, 5):
        robot.packed_torque(*motion_of(backend, 3, samples))
    assert taken == [3, 4]
    robot.packed_torque(*motion_of(backend, 3))
    monkeypatch.setattr(module, "CROSSINGS", {"torque": Crossing(operations + 1, rows)})
    package.load(backend).packed_torque(*motion_of(backend, 3))
    assert taken == [3, 4, 3], "one sample without an axis of samples has a row of its own"
    assert [largest_batch(rows, size) for size in (9, 10, operations, 9999)] == [0, 0, 4, 99]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_package_without_closed_forms_computes_by_the_rule(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("torso")
    plain = package.load(backend)
    bare = type(plain.backend)(package.ROBOT, None, {}, plain.backend.rule)
    motion = motion_of(backend, plain.n, 40)
    assert relative_error(bare.torque(*motion), plain.packed_torque(*motion)) <= 1e-14
    with pytest.raises(
        ValueError, match="this package has no closed forms; take kernel='rule', or generate it"
    ):
        type(plain.backend)(package.ROBOT, None, {}, plain.backend.rule, "straight")


@needs_compiler
def test_gradients_of_native_need_no_closed_forms(
    package_of: Callable[[str], ModuleType], directory_of: Callable[[str], Path]
) -> None:
    package = package_of("planar3")
    made = package.load("native").backend
    bare = type(made)(package.ROBOT, directory_of("planar3") / "c", None, {}, made.rule)
    motion = [a.requires_grad_() for a in motion_of("torch", 3)]
    bare.on_torch.operators = dict(made.on_torch.operators)
    assert torch.autograd.gradcheck(bare.on_torch.torque, motion)


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
@pytest.mark.parametrize("call", CALLS)
def test_the_rule_runs_under_transformations(call: str, package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of("torso").load("torch", kernel="rule")
    motion = motion_of("torch", robot.n, 4)
    function = getattr(robot, call)
    assert relative_error(torch.func.vmap(function)(*motion), function(*motion)) <= 1e-14
    q, qd, qdd = (a[0] for a in motion)
    slopes = [
        jacobian(lambda x: robot.partial_torque(x, qd, qdd))(q)
        for jacobian in (torch.func.jacrev, torch.func.jacfwd)
    ]
    for slope in slopes:
        assert relative_error(robot.position_gradient(q, qd, qdd), slope) <= 1e-13
    with torch.inference_mode():
        assert relative_error(function(*motion), function(*motion)) == 0.0
    q, qd, qdd = (a[:0] for a in motion)
    slope = torch.func.jacfwd(lambda x: function(x, qd, qdd))(q)
    assert slope.shape == (*function(q, qd, qdd).shape, *q.shape)


class Torques(torch.nn.Module):  # type: ignore[misc]
    """A module around a robot, as users of torch.export have it."""

    def __init__(self, robot: Any) -> None:
        super().__init__()
        self.robot = robot

    def forward(self, q: Any, qd: Any, qdd: Any) -> Any:
        return self.robot.partial_torque(q, qd, qdd)


def test_a_robot_is_exported_with_any_number_of_samples(tmp_path: Path) -> None:
    write_package(generate(read_system("planar2"), ["torch"]), tmp_path / "planar2")
    package = import_package(tmp_path / "planar2")
    robot = package.load("torch")
    axis = {0: torch.export.Dim("samples", min=2, max=4096)}
    exported = torch.export.export(
        Torques(robot), tuple(motion_of("torch", 2, 3)), dynamic_shapes=(axis, axis, axis)
    )
    motion = motion_of("torch", 2, 17)
    expected = package.load("numpy" if "numpy" in package.BACKENDS else "torch", kernel="straight")
    assert relative_error(exported.module()(*motion), expected.partial_torque(*motion)) <= 1e-14
    assert relative_error(robot.partial_torque(*motion), expected.partial_torque(*motion)) <= 1e-14


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
def test_a_robot_is_compiled_in_one_piece(tmp_path: Path) -> None:
    write_package(generate(read_system("planar2"), ["torch"]), tmp_path / "planar2")
    package = import_package(tmp_path / "planar2")
    compiled = torch.compile(package.load("torch").partial_torque, fullgraph=True)
    motion = motion_of("torch", 2, 16)
    expected = package.load("torch", kernel="straight").partial_torque(*motion)
    assert relative_error(compiled(*motion), expected) <= 1e-14
    assert compiled(*(a[:0] for a in motion)).shape == (0, 2, 2)


def test_a_robot_with_parameters_of_its_own_is_compiled_in_one_piece(arm: ModuleType) -> None:
    robot, motion = arm.load("torch", kernel="rule"), motion_of("torch", 3, 4)
    compiled = torch.compile(robot.packed_torque, fullgraph=True, backend="eager")
    expected = arm.load("torch", kernel="straight").packed_torque(*motion)
    assert relative_error(compiled(*motion), expected) <= 1e-14


@pytest.mark.parametrize("far", ["10 0 0", "1000 300 0"])
def test_an_arm_far_from_another_one_keeps_its_digits(far: str, tmp_path: Path) -> None:
    arms = [
        f'<link name="{side}{j}"><inertial><origin xyz="0.1 0.02 0.03"/><mass value="1"/>'
        '<inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="0.002" iyz="-0.001"/></inertial></link>'
        f'<joint name="{side}{j}" type="revolute"><parent link="{side}{j - 1}"/><child link="{side}{j}"/>'
        f'<origin rpy="1 0.3 0" xyz="0.2 0 0.1"/><axis xyz="0 0 1"/><limit effort="1" velocity="1"/></joint>'
        for side in "ab"
        for j in (1, 2, 3)
    ]
    bases = '<link name="base"/><link name="a0"/><link name="b0"/>' + "".join(
        f'<joint name="to_{side}" type="fixed"><parent link="base"/><child link="{side}0"/>'
        f'<origin xyz="{place}"/></joint>'
        for side, place in (("a", "0 0 0"), ("b", far))
    )
    (tmp_path / "arms.urdf").write_text(f'<robot name="arms">{bases}{"".join(arms)}</robot>')
    write_package(generate(read_system(tmp_path / "arms.urdf"), ["numpy"]), tmp_path / "arms")
    package = import_package(tmp_path / "arms")
    motion = motion_of("numpy", 6, 5)
    exact = package.load("numpy", kernel="straight").packed(*motion)
    single = package.load("numpy", kernel="rule").packed(*(a.astype(np.float32) for a in motion))
    for one, other in zip(package.load("numpy", kernel="rule").packed(*motion), exact, strict=True):
        assert relative_error(one, other) <= 1e-14
    for one, other in zip(single, exact, strict=True):
        assert relative_error(one, other) <= 3e-6


@pytest.mark.parametrize("backend", ["numpy", "torch"])
@pytest.mark.parametrize("field", ["masses", "centres", "inertias"])
def test_of_bodies_one_quantity_alone_may_differ_by_sample(
    backend: str, field: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("puma560")
    own, q = package.bodies(), np.random.default_rng(3).uniform(-1.0, 1.0, (3, 6))
    several = np.stack([scale * getattr(own, field) for scale in (1.0, 1.1, 0.9)])
    found = package.load(backend, bodies=own._replace(**{field: several})).partial_torque(q, q, q)
    for k, one in enumerate(several):
        alone = package.load(backend, bodies=own._replace(**{field: one}))
        assert relative_error(np.asarray(found[k]), np.asarray(alone.partial_torque(*[q[k]] * 3))) <= 1e-13
