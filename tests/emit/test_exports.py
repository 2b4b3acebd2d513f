"""Calls as modules of torch: compiled, exported and under onnxruntime they answer as they do themselves.

`make exports` holds every call of the table in docs/exports.md to all three ways; here are some, and all that
the page says does not work.
"""

import copy
import inspect
import pickle
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import LOCKED_FINGERS, PANDA, needs_compiler
from helpers.answers import relative_error
from linkwise import Options, read_system

torch = pytest.importorskip("torch", reason="needs torch: pip install torch")
exported = pytest.importorskip("helpers.exported", reason="needs onnxruntime: pip install 'linkwise[onnx]'")

pytestmark = [
    pytest.mark.ship,
    pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:.isinstance.treespec, LeafSpec:FutureWarning"),  # torch's own
]
Packages = Callable[[str], ModuleType]


@pytest.fixture
def planar2(package_of: Packages) -> Any:
    return package_of("planar2").load("torch")


def test_the_page_has_every_call_in_its_table(planar2: Any) -> None:
    """Calls of constraints are excepted, one that is for these alone, and one that programs answer."""
    calls = {
        f"{of}{name}"
        for of, kind in (("", type(planar2)), ("kinematics.", type(planar2.kinematics)))
        for name, call in inspect.getmembers(kind, inspect.isfunction)
        if list(inspect.signature(call).parameters)[1:2] == ["q"]
    }
    assert dict(exported.table()).keys() == calls - {"induced_reactions", "share_bounds"}


@pytest.mark.parametrize("call", dict(exported.table()))
def test_a_module_answers_as_the_call_does(call: str, planar2: Any) -> None:
    module, count = exported.module_of(planar2, call)
    given = exported.motion(planar2, count, 3)
    of: Any = planar2
    for name in call.split("."):
        of = getattr(of, name)
    answer = of(*given, **module.fixed)
    assert exported.error(module(*given), answer if torch.is_tensor(answer) else answer._asdict()) == 0.0
    names = [name for name in inspect.signature(of).parameters if name not in {"out", *module.fixed}]
    assert list(inspect.signature(module.forward).parameters) == names


def test_exported_torques_are_pinocchios_for_any_number_of_samples(package_of: Packages) -> None:
    pytest.importorskip("pinocchio", reason="needs pinocchio: pip install pin")
    if not PANDA.is_file():
        pytest.skip("needs real robots: pip install example-robot-data")
    from numeric.pinocchio_model import PinocchioModel

    robot = package_of(str(PANDA)).load("torch")
    oracle = PinocchioModel(PANDA, read_system(PANDA, Options(lock=LOCKED_FINGERS)), False, LOCKED_FINGERS)
    program = exported.exported(robot.module("inverse_dynamics"), exported.motion(robot, 3, 5))
    run = exported.in_onnx(program)
    for samples in (17, 1, 0):
        given = exported.motion(robot, 3, samples, seed=samples)
        sums = [oracle.torque(*(a.numpy() for a in one)) for one in zip(*given, strict=True)]
        for found in (program.module()(*given), *run(*given)):
            assert found.shape == (samples, 7)
            if samples:
                assert relative_error(found, np.stack(sums)) <= 1e-13


def test_single_precision_goes_to_onnx_by_name(planar2: Any) -> None:
    module = planar2.module("kinematics.velocity", frame="link2")
    given = [a.float() for a in exported.motion(planar2, 2, 3)]
    program = exported.exported(module, given)
    assert [node.name for node in program.graph.nodes if node.op == "placeholder"][-2:] == ["q", "qd"]
    (found,) = exported.in_onnx(program)(*given)
    assert found.dtype == torch.float32
    assert relative_error(found, planar2.kinematics.velocity(*(a.double() for a in given), "link2")) <= 1e-6


def test_run_time_parameters_stay_inputs_of_what_is_exported(package_of: Packages) -> None:
    mass = torch.nn.Parameter(torch.tensor(1.3, dtype=torch.float64))
    robot = package_of("planar3 symbolic").load("torch", parameters={"m_2": mass})
    module, given = robot.module("mass_matrix"), exported.motion(robot, 1, 3)
    assert [name for name, _ in module.named_parameters()] == ["values.m_2"]
    program = torch.export.export(module, given)
    program.state_dict["values.m_2"].data.fill_(2.0)
    assert "values.m_2" in program.graph_signature.parameters
    expected = package_of("planar3 symbolic").load("torch", parameters={"m_2": 2.0}).mass_matrix(*given)
    assert relative_error(program.module()(*given).detach(), expected) <= 1e-14


@pytest.mark.parametrize("way", ["deepcopy", "pickle", "load_state_dict", "functional_call"])
def test_a_module_computes_with_what_it_holds(way: str, package_of: Packages) -> None:
    package = package_of("planar3 symbolic")
    robot, other = (package.load("torch", parameters={"m_2": mass}) for mass in (1.3, 2.0))
    module, given = robot.module("inverse_dynamics"), exported.motion(robot, 3, 4)
    before, wanted = robot.inverse_dynamics(*given), other.inverse_dynamics(*given)
    changed: Any = {
        "deepcopy": copy.deepcopy,
        "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    }.get(way, lambda one: one)(module)
    state = other.module("energy").state_dict()
    if way == "functional_call":
        found = torch.func.functional_call(module, state, given)
    else:
        changed.load_state_dict(state)
        found = changed(*given)
    assert torch.equal(found, wanted)
    assert torch.equal(module(*given), wanted if way == "load_state_dict" else before)
    assert torch.equal(robot.inverse_dynamics(*given), before)


def test_bodies_are_held_by_the_module(package_of: Packages) -> None:
    package = package_of("planar2")
    masses = torch.nn.Parameter(torch.tensor([1.0, 2.0], dtype=torch.float64))
    robot = package.load("torch", bodies=package.bodies()._replace(masses=masses))
    module, given = robot.module("gravity_torque"), exported.motion(robot, 1, 3)
    assert list(module.state_dict()) == ["bodies.masses", "bodies.centres", "bodies.inertias"]
    twice = {"bodies.masses": 2.0 * masses}
    assert (
        relative_error(
            torch.func.functional_call(module, twice, given).detach(),
            2.0 * robot.gravity_torque(*given).detach(),
        )
        <= 1e-14
    )


def test_autograd_is_exported_with_its_gradients_and_compiled_but_onnx_rounds_its_numbers(
    package_of: Packages,
) -> None:
    package, call = package_of("planar2"), "inverse_dynamics"
    module, count = exported.module_of(package.load("autograd"), call)
    oracle = exported.module_of(package.load("torch"), call)[0]
    example = [a.requires_grad_() for a in exported.motion(module.robot, count, 4)]
    program = exported.exported(module, example)
    run, compiled = exported.in_onnx(program), torch.compile(module, fullgraph=True, backend="aot_eager")
    for samples in (7, 1, 0):
        given = exported.motion(module.robot, count, samples, seed=samples)
        expected = oracle(*given)
        for found in (program.module()(*given), compiled(*given)):
            assert exported.error(found, expected) <= 1e-12
        rounded = exported.error(dict(enumerate(run(*given))), expected)
        assert rounded <= 1e-7 if samples == 0 else 1e-9 < rounded <= 1e-7
    given = [a.requires_grad_() for a in exported.motion(module.robot, count, 3)]
    answers = (program.module()(*given), oracle(*given))
    sums = [sum(a.sum() for a in exported.results(answer)) for answer in answers]
    for found, wanted in zip(*(torch.autograd.grad(one, given) for one in sums), strict=True):
        assert relative_error(found, wanted) <= 1e-12
    with pytest.raises(Exception, match="Dynamo"):
        torch.export.export(module, exported.motion(module.robot, count, 4), strict=True)


def test_an_example_of_one_sample_or_none_fixes_their_number(planar2: Any) -> None:
    module = planar2.module("energy")
    for samples in (0, 1):
        with pytest.raises(Exception, match="Constraints violated"):
            exported.exported(module, exported.motion(planar2, 2, samples))


def test_a_module_of_autograd_learns_the_robots_numbers(package_of: Packages) -> None:
    robot = package_of("planar2").load("autograd", requires_grad="mass")
    module, given = robot.module("coefficients"), exported.motion(robot, 2, 3)
    sum(a.sum() for a in module(*given).values()).backward()
    assert {name for name, _ in module.named_parameters()} == {f"robot.links.link{j}.mass" for j in (1, 2)}
    assert all(parameter.grad for parameter in robot.parameters())


def test_forward_dynamics_is_compiled_and_exported_with_its_gradient_but_onnx_solves_nothing(
    planar2: Any,
) -> None:
    module = planar2.module("forward_dynamics", passive=True)
    given = tuple(a.requires_grad_() for a in exported.motion(planar2, 3, 3))
    compiled = torch.compile(module, fullgraph=True, backend="aot_eager")
    slopes = [torch.autograd.grad(f(*given).sum(), given) for f in (compiled, module)]
    for found, expected in zip(*slopes, strict=True):
        assert relative_error(found, expected) <= 1e-12
    given = tuple(a.detach() for a in given)
    program = torch.export.export(module, given)
    assert relative_error(program.module()(*given), module(*given)) <= 1e-13
    with pytest.raises(torch.onnx.OnnxExporterError) as refused:
        exported.in_onnx(program)
    assert "linalg_solve" in str(refused.value.__cause__)


@pytest.mark.parametrize("samples", [None, 3])
def test_christoffel_and_shares_of_accelerations_take_any_number_of_samples(
    samples: Any, planar2: Any
) -> None:
    """Shapes are computed, and must not be those of the samples that they were traced with."""
    call, count = ("christoffel", 1) if samples is None else ("induced_accelerations", 3)
    module = exported.module_of(planar2, call)[0]
    program = torch.export.export(
        module, exported.motion(planar2, count, 5), dynamic_shapes=exported.any_samples(count)
    )
    given = exported.motion(planar2, count, 2)
    assert (
        exported.error(dict(enumerate(exported.results(program.module()(*given)))), module(*given)) <= 1e-13
    )
    if call == "induced_accelerations":
        with pytest.raises(torch.onnx.OnnxExporterError) as refused:
            exported.in_onnx(program)
        assert "linalg_solve" in str(refused.value.__cause__)


def test_what_looks_at_numbers_is_neither_compiled_whole_nor_exported(package_of: Packages) -> None:
    robots = [package_of("planar2").load("torch", check_finite=check) for check in (False, True)]
    for robot, call in zip(robots, ("simulate", "gravity_torque"), strict=True):
        module, count = exported.module_of(robot, call)
        given = exported.motion(robot, count, 3)
        assert exported.results(module(*given))
        with pytest.raises(Exception, match=r"data-dependent|Data-dependent|numpy|Unsupported"):
            torch.compile(module, fullgraph=True, backend="eager")(*given)
        with pytest.raises(Exception, match=r"data-dependent|torch.export hide"):
            torch.export.export(module, given)


@needs_compiler
def test_back_ends_without_modules_and_calls_that_are_not_there_are_refused(package_of: Packages) -> None:
    package = package_of("planar2")
    for backend in ("numpy", "native"):
        with pytest.raises(TypeError, match=f"{backend} has no torch modules; load torch or autograd"):
            package.load(backend).module("energy")
    robot = package.load("torch")
    for call in ("energies", "layout", "kinematics", "kinematics.frames", "joint_index"):
        with pytest.raises(ValueError, match=f"'{call}' is no call of planar2 that is given positions q"):
            robot.module(call)
    with pytest.raises(ValueError, match=r"^energy takes no 'frame'; it takes q, qd$"):
        robot.module("energy", frame="link1")
    with pytest.raises(TypeError, match="missing a required argument: 'qd'"):
        robot.module("energy")(torch.zeros(2))
