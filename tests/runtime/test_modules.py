"""`load("autograd")` and its links as torch modules: what they own, and what torch's tools make of them."""

import copy
import importlib
import io
import pickle
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.answers import random_states
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.symbolic.system import RigidSystem, rigid_system

torch = pytest.importorskip("torch")

CALLS = ("packed_torque", "partial_torque", "inverse_dynamics", "position_gradient")


@pytest.fixture(scope="module")
def puma(package_of: Callable[[str], ModuleType]) -> ModuleType:
    return package_of("puma560")


@pytest.fixture(scope="module")
def planar2(package_of: Callable[[str], ModuleType]) -> ModuleType:
    return package_of("planar2")


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A user's energies, whose two links share parameters."""
    folder = tmp_path_factory.mktemp("cart") / "cart"
    write_package(generate(read_system(DATA / "cart_pendulum.py", Options("symbolic"))), folder)
    return import_package(folder)


def states(n: int, count: int, seed: int = 0) -> list[Any]:
    return [torch.from_numpy(np.array(a)) for a in random_states(n, count, seed)]


def relative_error(value: Any, reference: Any) -> float:
    """Largest difference in a ratio to the reference's largest magnitude; to 1 where all of that is zero."""
    value, reference = (np.asarray(torch.as_tensor(a).detach()) for a in (value, reference))
    assert value.shape == reference.shape
    return float(np.abs(value - reference).max() / (np.abs(reference).max() or 1.0))


def test_a_link_is_one_lasting_module_by_number_and_by_name(puma: ModuleType) -> None:
    robot = puma.load("autograd")
    assert isinstance(robot, torch.nn.Module)
    assert robot.links["link3"] is robot.links[2] is robot.links[-4]
    assert list(robot.links) == [robot.links[name] for name in robot.link_names]
    assert len(robot.links) == 6
    with pytest.raises(
        ValueError, match=r"the link is 'link9'; choose a link by number, 0..5, or by name: link1, "
    ):
        robot.links["link9"]
    with pytest.raises(ValueError, match=r"the link is 6; choose a link by number, 0..5"):
        robot.links[6]


def test_a_links_torque_and_coefficients_are_the_robots_part_through_it(puma: ModuleType) -> None:
    robot, forms, motion = puma.load("autograd"), puma.load("numpy"), states(6, 7)
    tau, whole = forms.partial_torque(*motion), forms.coefficients(*motion[:2])
    for j, link in enumerate(robot.links):
        assert relative_error(link.torque(*motion), tau[:, :, j]) <= 1e-13
        for found, expected in zip(link.coefficients(*motion[:2]), whole, strict=True):
            assert found.shape == expected[:, :, j].shape
            assert relative_error(found, expected[:, :, j]) <= 1e-13
        one = [a[0] for a in motion]
        assert relative_error(link.torque(*one), tau[0, :, j]) <= 1e-13
        assert link(*one[:2]).shape == ()
    with pytest.raises(ValueError, match=r"q has shape \(5,\); its last axis must be 6, one for each joint"):
        robot.links[0](torch.zeros(5), torch.zeros(6))


def test_numbers_that_are_loaded_or_set_count_from_the_next_call_on(puma: ModuleType) -> None:
    """Zeros too: what a robot's zeros leave out of a sum comes back with other numbers."""
    robot, motion = puma.load("autograd"), states(6, 5)
    own = puma.bodies()
    draw = np.random.default_rng(2)
    other = type(own)(*(a + 0.05 * draw.uniform(0.5, 1.0, a.shape) for a in own))
    other = other._replace(inertias=0.5 * (other.inertias + other.inertias.swapaxes(1, 2)))
    state = robot.state_dict()
    assert {key.split(".")[-1] for key in state} == {"mass", "com", "inertia", "place"}
    for name, mass, com, inertia in zip(robot.link_names, *map(torch.from_numpy, other), strict=True):
        state |= {f"links.{name}.mass": mass, f"links.{name}.com": com, f"links.{name}.inertia": inertia}
    before = robot.partial_torque(*motion)
    robot.load_state_dict(state)
    expected = puma.load("torch", bodies=other)
    for call in CALLS:
        assert relative_error(getattr(robot, call)(*motion), getattr(expected, call)(*motion)) <= 1e-13
    assert relative_error(before, robot.partial_torque(*motion)) > 1e-3


def test_places_of_joints_that_are_set_are_those_of_such_a_robot(tmp_path: Path, puma: ModuleType) -> None:
    system = read_system("puma560")
    assert isinstance(system, RigidSystem)
    robot, draw = puma.load("autograd"), np.random.default_rng(3)
    links = []
    for rigid, module in zip(system.robot.links, robot.links, strict=True):
        place = tuple(draw.uniform(-0.3, 0.3, 3).tolist())
        links.append(replace(rigid, joint=replace(rigid.joint, translation=place)))
        module.place.copy_(torch.tensor(place, dtype=torch.float64))
    moved = rigid_system(replace(system.robot, links=tuple(links)))
    write_package(generate(moved, ["numpy"], "moved"), tmp_path / "moved")
    motion, expected = states(6, 5), import_package(tmp_path / "moved").load("numpy")
    for call in CALLS:
        assert relative_error(getattr(robot, call)(*motion), getattr(expected, call)(*motion)) <= 1e-12


def learned_rows(puma: ModuleType, motion: Any, weights: Any) -> Iterator[tuple[str, Any]]:
    """Slopes of weighted torques by every mass, centre and inertia, of the rule's torques."""
    bodies = type(puma.bodies())(*(torch.from_numpy(a).requires_grad_() for a in puma.bodies()))
    tau = puma.load("torch", bodies=bodies).partial_torque(*motion)
    slopes = torch.autograd.grad((tau * weights).sum(), list(bodies))
    for name, slope in zip(("mass", "com", "inertia"), slopes, strict=True):
        for link, row in zip(puma.link_names, slope, strict=True):
            yield f"links.{link}.{name}", row


def test_numbers_that_are_learned_have_the_slopes_of_the_rule(puma: ModuleType) -> None:
    robot, motion = puma.load("autograd", requires_grad=("mass", "com", "inertia")), states(6, 4)
    learned = dict(robot.named_parameters())
    assert len(learned) == 18
    weights = torch.from_numpy(np.random.default_rng(4).standard_normal((4, 6, 6)))
    (robot(*motion) * weights).sum().backward()
    for name, slope in learned_rows(puma, motion, weights):
        symmetric = 0.5 * (slope + slope.mT) if slope.dim() == 2 else slope
        assert relative_error(learned[name].grad, symmetric) <= 1e-12, name
    assert "links.link2.place" not in learned
    assert puma.load("autograd", requires_grad=True).links["link2"].place.requires_grad
    assert not list(puma.load("autograd").parameters())


def test_places_and_second_derivatives_are_those_of_differences(planar2: ModuleType) -> None:
    robot = planar2.load("autograd", requires_grad=True)
    link, motion = robot.links[1], [a[0].requires_grad_() for a in states(2, 1)]
    names = [name for name, _ in robot.named_parameters()]

    def torque(*values: Any) -> Any:
        module = torch.func.functional_call(robot, dict(zip(names, values[3:], strict=True)), values[:3])
        return module[:, 1]

    given = (*motion, *(a.detach().clone().requires_grad_() for a in robot.parameters()))
    assert torch.autograd.gradcheck(torque, given)
    assert torch.autograd.gradgradcheck(link.torque, motion)
    mass, turning, gravity = link.coefficients(*motion[:2])
    (slope,) = torch.autograd.grad(mass.sum() + turning.sum() + gravity.sum(), link.place)
    assert slope.shape == (3,)
    assert slope[:2].abs().min() > 0.0


def test_what_is_learned_keeps_out_of_memory_given_for_the_answer(planar2: ModuleType) -> None:
    robot, motion = planar2.load("autograd", requires_grad="mass"), states(2, 3)
    out = torch.empty(3, 2, dtype=torch.float64)
    with pytest.raises(TypeError, match="out keeps no gradient, which the motion or a parameter requires"):
        robot.inverse_dynamics(*motion, out=out)
    with torch.no_grad():
        assert torch.equal(robot.inverse_dynamics(*motion, out=out), robot.inverse_dynamics(*motion))


def test_run_time_parameters_have_one_owner_and_links_share_them(cart: ModuleType) -> None:
    robot, motion = cart.load("autograd", requires_grad=("m", "r")), states(2, 4)
    assert sorted(robot.state_dict()) == ["values.M", "values.g", "values.k", "values.m", "values.r"]
    assert {name for name, _ in robot.named_parameters()} == {"values.m", "values.r"}
    assert dict(robot.parameters)["m"] is robot.values["m"]
    values = [torch.tensor(robot.parameters[name].item(), requires_grad=True) for name in "mr"]
    given = dict(zip("mr", (v.double() for v in values), strict=True))
    expected = cart.load("torch", given).partial_torque(*motion).square().sum()
    robot.partial_torque(*motion).square().sum().backward()
    for one, other in zip(torch.autograd.grad(expected, values), robot.parameters(), strict=True):
        assert relative_error(other.grad, one) <= 1e-6  # values passed through float32
    free = cart.load("autograd", {"m": torch.nn.Parameter(torch.tensor(0.4))})
    assert [name for name, _ in free.named_parameters()] == ["values.m"]


@pytest.mark.parametrize(
    ("backend", "asked", "message"),
    [
        (
            "numpy",
            True,
            "numpy has no torch modules; load autograd with requires_grad, or torch with tensors",
        ),
        ("torch", "mass", "torch has no torch modules; load autograd with requires_grad"),
        ("autograd", "weight", "requires_grad names 'weight'; choose among mass, com, inertia, place$"),
    ],
)
def test_what_cannot_be_learned_is_refused(
    backend: str, asked: Any, message: str, planar2: ModuleType
) -> None:
    with pytest.raises(ValueError, match=message):
        planar2.load(backend, requires_grad=asked)


@pytest.mark.parametrize(("given", "kept"), [(2, "float64"), (2.0, "float32")], ids=["whole", "real"])
def test_a_learned_tensor_keeps_its_precision_and_a_whole_one_becomes_real(
    given: float, kept: str, package_of: Callable[[str], ModuleType]
) -> None:
    load = package_of("planar3 symbolic").load
    learned = load("autograd", parameters={"m_2": torch.tensor(given)}, requires_grad="m_2").values["m_2"]
    assert learned.requires_grad
    assert learned.dtype == getattr(torch, kept)


def test_constants_that_hang_on_run_time_parameters_in_every_link_cannot_be_asked_for(
    package_of: Callable[[str], ModuleType],
) -> None:
    load = package_of("planar3 symbolic").load
    with pytest.raises(ValueError, match=r"'mass', which hangs on run-time parameters .*these: near it"):
        load("autograd", requires_grad="mass")
    assert dict(load("autograd", requires_grad="m_2").named_parameters()).keys() == {"values.m_2"}
    with pytest.raises(TypeError, match="requires_grad is 3; give True, or names: mass, "):
        load("autograd", requires_grad=3)


def test_a_longer_arm_has_the_same_numbers_under_the_same_names(
    package_of: Callable[[str], ModuleType],
) -> None:
    short, long = (package_of(name).load("autograd") for name in ("planar2", "planar3"))
    state, longer = short.state_dict(), long.state_dict()
    assert all(torch.equal(state[key], longer[key]) for key in state)
    assert {key.split(".")[1] for key in longer.keys() - state} == {"link3"}
    motion = states(3, 4)
    begun = [a[:, :2] for a in motion]
    for j in range(2):
        assert torch.equal(long.links[j].torque(*motion)[:, :2], short.links[j].torque(*begun))


@pytest.mark.parametrize("way", ["deepcopy", "pickle", "save"])
def test_a_copy_has_numbers_parameters_and_hooks_of_its_own(way: str, planar2: ModuleType) -> None:
    robot, motion = planar2.load("autograd", requires_grad="mass"), states(2, 3)
    with torch.no_grad():
        robot.links[0].mass.fill_(2.5)
    robot.links[1].register_forward_hook(_doubled)
    for one in (robot, robot.links[1]):
        if way == "deepcopy":
            other = copy.deepcopy(one)
        elif way == "pickle":
            other = pickle.loads(pickle.dumps(one))
        else:
            torch.save(one, buffer := io.BytesIO())
            buffer.seek(0)
            other = torch.load(buffer, weights_only=False)
        links = (other.links[1], other.links[0]) if one is robot else (other, other.before)
        assert links[0].before is links[1]
        assert links[1].mass.item() == 2.5
        assert links[1].mass.requires_grad
        assert torch.equal(links[0](*motion[:2]), robot.links[1](*motion[:2]))
        assert torch.equal(links[0].torque(*motion), robot.links[1].torque(*motion))
        with torch.no_grad():
            links[1].mass.fill_(1.0)
        assert robot.links[0].mass.item() == 2.5
    assert torch.equal(copy.deepcopy(robot)(*motion), robot(*motion))


def _doubled(module: Any, given: Any, result: Any) -> Any:
    return 2.0 * result


def test_hooks_see_calls_of_modules(planar2: ModuleType) -> None:
    robot, motion = planar2.load("autograd"), [a.requires_grad_() for a in states(2, 3)]
    seen: list[str] = []
    robot.register_forward_hook(lambda module, given, result: seen.append("robot"))
    robot.links[1].register_forward_pre_hook(lambda module, given: seen.append("before"))
    robot.links[1].register_full_backward_hook(lambda module, into, out: seen.append("back"))
    robot.links[1](*motion[:2]).sum().backward()
    robot(*motion)
    assert seen == ["before", "back", "robot"]


def test_modules_move_between_precisions_and_into_containers(planar2: ModuleType) -> None:
    robot, motion = planar2.load("autograd"), states(2, 3)
    expected = robot(*motion)
    group = torch.nn.ModuleDict({"arm": robot, "tip": robot.links[1]}).to(torch.float32)
    assert {a.dtype for a in group.buffers()} == {torch.float32}
    assert "arm.links.link2.mass" in group.state_dict()
    assert relative_error(robot(*motion), expected) <= 1e-6
    assert robot(*(a.float() for a in motion)).dtype == torch.float32
    planar2.load("autograd").double().load_state_dict(robot.double().state_dict())
    assert robot.links[0].mass.dtype == torch.float64


class Torques(torch.utils.data.Dataset[Any]):
    """Torques that a worker computes."""

    def __init__(self, robot: Any) -> None:
        self.robot = robot

    def __len__(self) -> int:
        return 6

    def __getitem__(self, at: int) -> Any:
        return self.robot(*(torch.full((2,), value * at, dtype=torch.float64) for value in (0.1, 0.2, 0.3)))


def test_workers_of_a_data_loader_compute_with_it(
    directory_of: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Spawned, as everywhere but on Linux before Python 3.14, a worker imports the package by itself.
    monkeypatch.syspath_prepend(directory_of("planar2").parent)
    data = Torques(importlib.import_module("planar2").load("autograd"))
    expected = torch.stack([data[at] for at in range(6)])
    loader = torch.utils.data.DataLoader(data, batch_size=3, num_workers=1, multiprocessing_context="spawn")
    assert torch.equal(torch.cat(list(loader)), expected)


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
@pytest.mark.parametrize("robot", ["planar2", "cart"])
def test_transformations_of_torch_go_through_every_call(
    robot: str, planar2: ModuleType, cart: ModuleType
) -> None:
    module: Any = (planar2 if robot == "planar2" else cart).load("autograd")
    q, qd, qdd = states(2, 3)
    for call in (*CALLS, "packed"):
        plain, mapped = (f(q, qd, qdd) for f in (getattr(module, call), torch.vmap(getattr(module, call))))
        pairs = [(plain, mapped)] if torch.is_tensor(plain) else list(zip(plain, mapped, strict=True))
        assert all(relative_error(b, a) <= 1e-13 for a, b in pairs if a.numel()), call
    stiffness = module.position_gradient(q[0], qd[0], qdd[0])
    for jacobian in (torch.func.jacrev, torch.func.jacfwd):
        found = jacobian(lambda x: module(x, qd[0], qdd[0]))(q[0])
        assert relative_error(found, stiffness) <= 1e-13
    link = module.links[1]
    momentum = torch.func.hessian(lambda v: link(q[0], v))(qd[0])
    assert relative_error(momentum, link.coefficients(q[0], qd[0]).acceleration) <= 1e-13
    with torch.autograd.forward_ad.dual_level():
        dual = torch.autograd.forward_ad.make_dual(q[0], torch.eye(2, dtype=torch.float64)[1])
        tangent = torch.autograd.forward_ad.unpack_dual(module(dual, qd[0], qdd[0])).tangent
    assert relative_error(tangent, stiffness[..., 1]) <= 1e-13


def test_an_ensemble_of_numbers_is_one_mapped_call(planar2: ModuleType) -> None:
    robot, motion = planar2.load("autograd"), states(2, 3)
    masses = torch.tensor([0.5, 0.7], dtype=torch.float64)

    def torque(mass: Any) -> Any:
        return torch.func.functional_call(robot, {"links.link1.mass": mass}, tuple(motion))

    found = torch.vmap(torque)(masses)
    for mass, each in zip(masses, found, strict=True):
        assert relative_error(each, torque(mass)) <= 1e-13
    assert torch.equal(robot.links[0].mass, planar2.load("autograd").links[0].mass)
    slope = torch.func.jacrev(torque)(masses[0])
    assert relative_error(slope, (torque(masses[1]) - torque(masses[0])) / 0.2) <= 1e-12


def test_a_compiler_takes_energies_and_torques_whole(package_of: Callable[[str], ModuleType]) -> None:
    robot, motion = package_of("planar1").load("autograd", requires_grad="mass"), states(1, 3)
    for call, given in ((robot.links[0], motion[:2]), (robot, motion)):
        compiled = torch.compile(call, backend="aot_eager", fullgraph=True)(*given)
        plain = call(*given)
        slopes = [torch.autograd.grad(a.sum(), robot.links[0].mass)[0] for a in (compiled, plain)]
        assert relative_error(compiled, plain) <= 1e-13
        assert relative_error(*slopes) <= 1e-13


@pytest.mark.parametrize("backend", ["torch", "autograd"])
@pytest.mark.parametrize("robot", ["planar2", "cart"])
def test_a_call_is_compiled_once_and_once_more_for_any_number_of_samples(
    robot: str, backend: str, planar2: ModuleType, cart: ModuleType
) -> None:
    from torch._dynamo.testing import CompileCounter

    folder = Path(str((planar2 if robot == "planar2" else cart).__file__)).parent
    for call, count in (("propagation", 3), ("forward_dynamics", 3)):
        torch._dynamo.reset()
        fresh, counted = import_package(folder).load(backend), CompileCounter()
        run = torch.compile(getattr(fresh, call), fullgraph=True, backend=counted)
        for samples, compiled in ((5, 1), (5, 1), (7, 2), (3, 2), (5, 2)):
            motion = states(2, samples)[:count]
            found = run(*motion)
            assert counted.frame_count == compiled, (call, samples)
        pairs = [(found, expected)] if torch.is_tensor(expected := getattr(fresh, call)(*motion)) else []
        for one, other in pairs or zip(found, expected, strict=True):
            assert relative_error(one, other) <= 1e-12, call


def test_a_frame_is_compiled_once_whatever_else_is_asked(directory_of: Callable[[str], Path]) -> None:
    from torch._dynamo.testing import CompileCounter

    torch._dynamo.reset()
    robot, counted = import_package(directory_of("planar3")).load("torch"), CompileCounter()
    run = torch.compile(lambda q: robot.kinematics.pose(q, "link3"), fullgraph=True, backend=counted)
    for samples, compiled in ((5, 1), (5, 1), (7, 2), (3, 2)):
        (q, *_) = states(3, samples)
        found = run(q)
        assert counted.frame_count == compiled
        robot.kinematics.pose(q.float(), "link2")
        assert relative_error(found, robot.kinematics.pose(q, "link3")) <= 1e-13


def test_robots_compiled_one_after_the_other_do_not_share_tables(
    package_of: Callable[[str], ModuleType],
) -> None:
    def torque(robot: Any, *motion: Any) -> Any:
        return robot.inverse_dynamics(*motion), robot.kinematics.centre_of_mass(motion[0])

    torch._dynamo.reset()
    run, motion = torch.compile(torque, fullgraph=True, backend="eager"), states(3, 4)
    for name in ("planar3", "planar3 symbolic", "planar3"):
        robot = package_of(name).load("torch", kernel="rule")
        for one, other in zip(run(robot, *motion), torque(robot, *motion), strict=True):
            assert relative_error(one, other) <= 1e-13


@pytest.mark.parametrize(("call", "broken"), [("partial_torque", 1), ("mass_matrix", 0)])
def test_a_call_of_native_is_one_graph_beside_its_callers(
    planar2: ModuleType, call: str, broken: int
) -> None:
    from torch._dynamo.testing import CompileCounter

    native, expected = (getattr(planar2.load(name), call) for name in ("native", "torch"))
    motion = states(2, 5)[: 3 if broken else 1]

    def sines(*motion: Any) -> Any:
        return native(*motion).sin()

    torch._dynamo.reset()
    torch._dynamo.utils.counters.clear()
    counted = CompileCounter()
    compiled = torch.compile(sines, backend=counted)
    for _ in range(3):
        assert relative_error(compiled(*motion), sines(*motion)) <= 1e-13
    assert counted.frame_count == 1 + broken
    assert sum(torch._dynamo.utils.counters["graph_break"].values()) == broken
    torch._dynamo.reset()
    q = motion[0].requires_grad_()
    taken = (run(*motion).sin().sum() for run in (torch.compile(native, backend="aot_eager"), expected))
    assert relative_error(*(torch.autograd.grad(each, q)[0] for each in taken)) <= 1e-13


@pytest.mark.filterwarnings("ignore:`torch.jit.script:DeprecationWarning")
@pytest.mark.parametrize("backend", ["torch", "autograd", "numpy"])
def test_torch_jit_script_is_refused_by_its_name(planar2: ModuleType, backend: str) -> None:
    robot = planar2.load(backend)
    own = (
        (robot.module("partial_torque"), robot.links[0], robot.links[0].torque)
        if backend == "autograd"
        else ()
    )
    for one in (robot, robot.partial_torque, robot.kinematics, robot.kinematics.pose, *own):
        with pytest.raises(
            TypeError, match=r"^torch.jit.script compiles a part of Python .* take torch.compile"
        ):
            torch.jit.script(one)


@pytest.mark.filterwarnings("ignore:`torch.jit.trace:DeprecationWarning")
@pytest.mark.filterwarnings("ignore::torch.jit.TracerWarning")
def test_traced_by_torch_jit_a_call_is_right_or_refused(planar2: ModuleType) -> None:
    some, others = states(2, 5), states(2, 3, seed=1)
    robot = planar2.load("torch")
    for call in (robot.partial_torque, robot.module("partial_torque")):
        traced = torch.jit.trace(call, some)
        assert torch.equal(traced(*others), robot.partial_torque(*others))
    for call in ("poses", "centre_of_mass"):  # of a robot that has no constants of theirs yet
        traced = torch.jit.trace(getattr(planar2.load("torch").kinematics, call), some[:1])
        ours, expected = (each(others[0]) for each in (traced, getattr(robot.kinematics, call)))
        for one, other in zip(*((ours, expected) if call == "poses" else ([ours], [expected])), strict=True):
            assert torch.equal(one, other), call
    differentiated, compiled = planar2.load("autograd"), planar2.load("native")
    for call in (
        differentiated,
        differentiated.module("mass_matrix"),
        lambda *m: compiled.partial_torque(*m),
        compiled.partial_torque,
    ):
        with pytest.raises(TypeError, match=r"^torch.jit.trace does not see how .* take the back end torch"):
            torch.jit.trace(call, some if call is differentiated or not hasattr(call, "robot") else some[:1])


@pytest.mark.parametrize("backend", ["torch", "autograd"])
def test_a_call_of_a_robot_that_was_not_called_before_is_compiled_whole(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3")
    q = torch.rand(4, 3, dtype=torch.float64)
    module = package.load(backend).module("kinematics.pose", frame="link3")
    found = torch.compile(module, fullgraph=True, backend="eager")(q)
    torch.testing.assert_close(
        found, package.load(backend).kinematics.pose(q, "link3"), rtol=1e-13, atol=1e-13
    )
    torch._dynamo.reset()
