"""The table of calls holds Python, back ends, C's headers and docs/calls.md: none offers silently less."""

import inspect
import re
from collections.abc import Callable, Mapping
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.call import PACKED, Call, Quantity
from linkwise_runtime.call_table import CALLS, REQUIRED
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies
from linkwise_runtime.constraints.robot_constraints import Constraints
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.kinematics.robot_kinematics import Kinematics
from linkwise_runtime.quantities import AppliedLoad
from linkwise_runtime.robot_axes import axes_of, tied_axes
from tools.call_page import BESIDE_IN_C, PAGE, page

torch = pytest.importorskip("torch")

OF_TIES = (
    "constrained_partial_impedance",
    "constrained_frame_partial_impedance",
    "constrained_cancel",
    "contacts_keep",
)
"""Functions of C of tied joints for which no row is."""
TIED = """schema = 1
name = "press"
gravity = [0.5, -9.0, 0]
parameters = {I = 0.2}
joint = [
  {name = "crank", parent = "base", child = "crank", stiffness = 3.0, rest = 0.2, damping = 0.3},
  {name = "knee", parent = "crank", child = "rod", xyz = [0.3, 0, 0], armature = 0.2, friction = 0.4},
  {name = "ram", type = "prismatic", parent = "base", child = "slider", axis = [1, 0, 0], damping = 0.3},
  {name = "wrist", parent = "slider", child = "hand", xyz = [0, 0.1, 0], axis = [0, 3, 4], armature = 0.1},
  {name = "weld", type = "fixed", parent = "rod", child = "end", xyz = [1.1, 0, 0]},
]
link = [
  {name = "base"},
  {name = "crank"},
  {name = "rod", mass = 1.5, com = [0.3, 0.1, 0], inertia = {xx = "I", yy = "I", zz = "I"}},
  {name = "end"},
  {name = "slider", mass = 1.5},
  {name = "hand", mass = 0.7, com = [0.1, 0.1, 0.2], inertia = {xx = "I", yy = "I", zz = "I"}},
]
[[constraint]]
name = "pin"
type = "hinge"
first = "end"
second = "slider"
"""
"""Four joints, of which the loop leaves two independent, three links, five rows: axes differ in length."""
FREE, BARE = TIED.partition("[[constraint]]")[0], r", (stiffness|rest|damping|friction|armature) = [\d.]+"
TEXTS = {
    "tied": TIED,
    "free": FREE,
    "tied bare": re.sub(BARE, "", TIED),
    "free bare": re.sub(BARE, "", FREE),
}
CART = str(DATA / "cart_pendulum.py")
"""Cart with a pendulum, whose links are energies."""
WIRE = str(DATA / "bead_on_wire.py")
"""Bead on a wire, whose links are energies with a constraint."""
SIZES = {CART: (2, 0), WIRE: (2, 1)}
"""Number of joints of such a robot, and of its independent ones."""
KINDS = [
    *(("numpy", False), ("torch", True), ("autograd", True)),
    *(pytest.param("native", tensors, marks=needs_compiler) for tensors in (False, True)),
]
"""Back ends, and whether they are given tensors."""
OVER_TIME = ("simulate", "trace", "counterfactual")
"""Calls that are given instants; all but the first are given a motion over these."""
UNCERTAIN = UncertainBodies([0.1, 0.2, 0.05], 0.01, [0.1, 0.0, 0.2], 0.03)
INSTANTS, PARTS = [0.0, 0.01, 0.02], 7
"""Instants of `simulate`; and the entries of an axis that any torques may have."""
on_every_back_end = pytest.mark.parametrize(("backend", "tensors"), KINDS)
on_a_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
key_of = attrgetter("key")
for_every_row = pytest.mark.parametrize("row", CALLS.values(), ids=key_of)
Load = Callable[..., Any]


@pytest.fixture(scope="module")
def package_at(tmp_path_factory: pytest.TempPathFactory, directory_of: Callable[[str], Path]) -> Load:
    """Directory of a package: of the press by its key, or of another robot."""

    @cache
    def directory(which: str) -> Path:
        if which not in TEXTS:
            return directory_of(which)
        folder = tmp_path_factory.mktemp("press")
        (folder / "press.toml").write_text(TEXTS[which], encoding="utf-8")
        system = read_system(folder / "press.toml", Options("symbolic"))
        write_package(generate(system, ["numpy"] if "bare" in which else None), folder / "press")
        return folder / "press"

    return directory


@pytest.fixture(scope="module")
def load(package_at: Load) -> Load:
    """A robot on a back end."""
    return cache(lambda which, backend="numpy": import_package(package_at(which)).load(backend))


def of(row: Call) -> str:
    """Return the kind of robot that answers a row."""
    return "free" if row.ties == "refused" else "tied"


def given(load: Load, row: Call, batch: tuple[int, ...] = (), which: str = "tied") -> dict[str, Any]:
    """Return a row's arguments, in arrays: the motion, in which the loop closes, and what has to be given
    too."""
    draw, (n, m) = np.random.default_rng(2), SIZES.get(which, (4, 2))
    batch = (len(INSTANTS), *batch) if row.key in OVER_TIME[1:] else batch
    sizes = {"q": n, "qd": n, "qdd": n, "tau": n, "yd": m, "ydd": m}
    motion = {name: draw.uniform(-1.0, 1.0, (*batch, size)) for name, size in sizes.items()}
    if row.key in OVER_TIME[1:]:
        motion["q"] = motion["q"][:1] + 0.1 * motion["q"]  # angles do not leap
    if m:
        known = WIRE if which == WIRE else "tied"
        near = [0.4, 0.3] if which == WIRE else [0.9, -1.1, 1.3, 0.2]
        motion["q"] = load(known).constraints.closed(np.array(near) + 0.1 * motion["q"])
    hand = {"force": np.array([3.0, -2.0, 0.5]), "point": np.array([0.1, 0.2, -0.3])}
    torque = draw.uniform(-1.0, 1.0, (*batch, n, PARTS))
    beside = {
        **hand,
        "moment": np.array([0.5, 1.0, -1.0]),
        "frame": "hand",
        "mask": draw.uniform(0.0, 1.0, (3, n)),
        "time": INSTANTS,
        "torque": torque if row.chosen.get("by_link") else torque[..., 0],
        "tau": motion["tau"],
        "without": "share:gravity" if which in SIZES else "gravity",
        "bodies": UNCERTAIN,
        "loads": [] if which in SIZES else [AppliedLoad("hand", **hand)],
    }
    left = () if row.options.get("frame") else ("frame", "point")
    asked = {name: beside[name] for name in row.options if name in beside and name not in left}
    return {name: motion[name] for name in row.motion} | asked


def taken(
    asked: Mapping[str, Any], tensors: bool, dtype: str = "float64", device: str = "cpu"
) -> dict[str, Any]:
    """Return the arguments in arrays, or tensors on a device, of a dtype."""
    return {name: cast_to(value, tensors, dtype, device) for name, value in asked.items()}


def cast_to(value: Any, tensors: bool, dtype: str = "float64", device: str = "cpu") -> Any:
    """Return one argument in an array, or a tensor on a device, of a dtype; what is no array as it is."""
    if isinstance(value, list) and value and isinstance(value[0], AppliedLoad):
        return [
            AppliedLoad("hand", *(cast_to(a, tensors, dtype, device) for a in value[0][1:])) for _ in value
        ]
    if not isinstance(value, np.ndarray):
        return value
    array = value.astype(dtype)
    return torch.from_numpy(array).to(device) if tensors else array


def answered(robot: Any, row: Call, asked: Mapping[str, Any], **more: Any) -> tuple[Any, ...]:
    """The arrays of a row's answer, in its record."""
    answer = attrgetter(row.name)(robot)(**{**asked, **row.chosen, **more})
    assert type(answer) is row.record if row.record else not isinstance(answer, tuple)
    return tuple(answer)[: len(row.answers)] if row.record else (answer,)


def shape_of(
    robot: Any, row: Call, quantity: Quantity, batch: tuple[int, ...], loads: int
) -> tuple[int, ...]:
    """Return the shape of a quantity by the axes that the row has for it."""
    axes = axes_of(robot.joint_names, robot.joint_units, robot.link_names, robot.share_names)
    sizes = dict(zip(PACKED, robot.structure.sizes, strict=True)) | {"part": PARTS, "load": loads}
    ties = robot.constraints if row.ties == "kept" and robot.backend.ties_joints else None
    axes |= tied_axes(ties.independent, ties.independent, ties.rows, ties.rows) if ties else {}
    if row.rigid:
        sizes["frame"] = len(robot.kinematics.frames)
    sizes |= {name: len(axis.names) for name, axis in axes.items() if name != "part"}
    sizes["holder"] = robot.N + len(robot.structure.armature_joints)
    sizes["moved"] = sizes["constraint" if row.key == "induced_reactions" else "joint"]
    sizes |= {"mover": sizes["independent" if ties else "cause"], "tree_joint": len(robot.tree_joint_names)}
    samples = (len(INSTANTS), *batch) if row.key in OVER_TIME else batch
    sums = robot.structure.passive_sums
    own = [*(k or f for k, f in zip(sums.stiffness, sums.pull, strict=True)), *sums.damping, *sums.friction]
    # By joint, by share, by what joints have of their own, by load; the residual and the start.
    sizes["origin"] = robot.n + len(robot.share_names) + np.count_nonzero(own) + loads + 2
    sizes["window"] = 1
    return (*(samples[:1] if quantity.name == "time" else samples), *(sizes[axis] for axis in quantity.axes))


def refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as info:
        call()
    assert "\n" not in str(info.value)


def check_answers(
    load: Load, which: str, row: Call, backend: str, tensors: bool, batch: tuple[int, ...], dtype: str
) -> None:
    """Hold an answer to NumPy's numbers, and its shapes, kind and dtype to the row and the motion."""
    robot, asked = load(which, backend), given(load, row, batch, which)
    expected = answered(load(which), row, taken(taken(asked, False, dtype), False))
    found = answered(robot, row, taken(asked, tensors, dtype))
    loads = len(asked.get("loads", ()))
    for quantity, value, right in zip(row.answers, found, expected, strict=True):
        assert tuple(value.shape) == shape_of(robot, row, quantity, batch, loads), quantity.name
        assert isinstance(value, np.ndarray) != tensors
        assert str(value.dtype).endswith(dtype)
        limit = {"float64": 1e-11, "float32": 2e-4}[dtype] * np.abs(right).max(initial=1.0)
        np.testing.assert_allclose(np.asarray(value), right, rtol=0, atol=limit, err_msg=quantity.name)


@for_every_row
def test_methods_take_what_the_row_says(row: Call) -> None:
    owner = {"kinematics": Kinematics, "constraints": Constraints}.get(row.name.partition(".")[0], Dynamics)
    parameters = inspect.signature(getattr(owner, row.name.rpartition(".")[2])).parameters
    first = next(other for other in CALLS.values() if other.name == row.name)
    assert list(parameters)[: 1 + len(row.motion)] == ["self", *row.motion]
    assert list(parameters)[-1:] == ["out"] or not row.out
    assert (row.chosen.keys(), row.options, row.out) == (first.chosen.keys(), first.options, first.out)
    defaults = {**first.options, **first.chosen, **({"out": None} if row.out else {})}
    found = {name: one.default for name, one in list(parameters.items())[1 + len(row.motion) :]}
    assert found == {
        name: one if one is not REQUIRED else inspect.Parameter.empty for name, one in defaults.items()
    }


@pytest.mark.parametrize(
    ("owner", "prefix"), [(Dynamics, ""), (Kinematics, "kinematics."), (Constraints, "constraints.")]
)
def test_every_call_on_motion_is_in_the_table(owner: type, prefix: str) -> None:
    functions = inspect.getmembers(owner, inspect.isfunction)
    calls = {
        f"{prefix}{name}" for name, one in functions if [*inspect.signature(one).parameters][1:2] == ["q"]
    }
    calls -= {"share_bounds"}  # of one motion, answered by programs and not by arrays
    named = {row.name for row in CALLS.values()}
    assert {name for name in calls if not name.startswith(f"{prefix}_")} == {
        name for name in named if (name.partition(".")[0] + "." if "." in name else "") == prefix
    }


@on_every_back_end
@for_every_row
def test_every_back_end_answers_with_the_same_numbers(
    row: Call, backend: str, tensors: bool, load: Load
) -> None:
    if backend in row.lacking:
        asked = taken(given(load, row), tensors)
        refused(lambda: answered(load(of(row), backend), row, asked), "load numpy, torch or native")
        return
    for batch in ((), (2, 3)):
        for dtype in ("float64", "float32"):
            check_answers(load, of(row), row, backend, tensors, batch, dtype)


@on_every_back_end
@for_every_row
def test_links_of_energies_answer_what_needs_no_rigid_links(
    row: Call, backend: str, tensors: bool, load: Load
) -> None:
    of_constraints = row.name.startswith("constraints.") or row.key == "induced_reactions"
    if not row.rigid:
        check_answers(load, WIRE if of_constraints else CART, row, backend, tensors, (2,), "float64")
    if row.rigid or of_constraints:
        asked = taken(given(load, row, (), CART), tensors)
        told = "rigid links|nothing reacts|write constraints with the energies"
        refused(lambda: answered(load(CART, backend), row, asked), told)


@on_every_back_end
@pytest.mark.parametrize("row", [row for row in CALLS.values() if row.out], ids=key_of)
def test_out_is_where_the_answer_goes(row: Call, backend: str, tensors: bool, load: Load) -> None:
    if backend in row.lacking:
        return
    for batch in ((), (3,)):
        asked = taken(given(load, row, batch), tensors)
        expected = answered(load(of(row), backend), row, asked)
        places = [cast_to(np.full(value.shape, np.nan), tensors) for value in expected]
        out = places if row.record else places[0]
        found = answered(load(of(row), backend), row, asked, out=out)
        assert [id(value) for value in found] == [id(place) for place in places]
        for place, value in zip(places, expected, strict=True):
            np.testing.assert_allclose(np.asarray(place), np.asarray(value), rtol=1e-12, atol=1e-12)


def slope(robot: Any, row: Call, asked: Mapping[str, Any]) -> Any:
    """Return the slope of the sum of all that is answered, by q; zero for what no gradient runs through."""
    q = asked["q"].requires_grad_()
    total = sum((value.sum() for value in answered(robot, row, asked)), 0.0 * q.sum())
    return torch.autograd.grad(total, q)[0]


@on_a_gpu
@pytest.mark.parametrize("backend", ["torch", "autograd"])
@for_every_row
def test_tensors_on_a_gpu_are_answered_there_with_gradients(row: Call, backend: str, load: Load) -> None:
    if backend in row.lacking:
        return
    robot = load(of(row), backend)
    for dtype, limit in (("float64", 1e-11), ("float32", 2e-4)):
        for batch in ((), (2, 3)):
            asked = given(load, row, batch)
            expected = answered(load(of(row)), row, taken(taken(asked, False, dtype), False))
            found = answered(robot, row, taken(asked, True, dtype, "cuda"))
            for quantity, value, right in zip(row.answers, found, expected, strict=True):
                assert (value.device.type, str(value.dtype)) == ("cuda", f"torch.{dtype}"), quantity.name
                bound = limit * np.abs(right).max(initial=1.0)
                np.testing.assert_allclose(value.cpu().numpy(), right, rtol=0, atol=bound)
    asked = given(load, row, (2,))
    found, expected = (slope(robot, row, taken(asked, True, device=device)) for device in ("cuda", "cpu"))
    assert found.device.type == "cuda"
    torch.testing.assert_close(found.cpu(), expected, rtol=1e-9, atol=1e-9)


@on_a_gpu
@pytest.mark.parametrize("row", [row for row in CALLS.values() if row.out], ids=key_of)
def test_out_on_a_gpu_is_filled_and_elsewhere_refused(row: Call, load: Load) -> None:
    robot, asked = load(of(row), "torch"), taken(given(load, row, (3,)), True, device="cuda")
    expected = answered(robot, row, asked)
    for where in ("cuda", "cpu"):
        places = [torch.full_like(value, torch.nan, device=where) for value in expected]
        out = places if row.record else places[0]
        if where == "cpu":
            with pytest.raises(TypeError, match="lies on cpu; the answer lies on cuda"):
                answered(robot, row, asked, out=out)
            continue
        found = answered(robot, row, asked, out=out)
        assert [id(value) for value in found] == [id(place) for place in places]
        assert all(torch.equal(place, value) for place, value in zip(places, expected, strict=True))


@on_a_gpu
def test_what_does_not_lie_on_the_gpu_of_the_motion_is_told(load: Load, package_at: Load) -> None:
    row = CALLS["partial_torque"]
    asked, here = taken(given(load, row, (3,)), True, device="cuda"), taken(given(load, row, (3,)), True)
    with pytest.raises(TypeError, match="lie on different devices; move them to one"):
        answered(load("tied", "torch"), row, {**asked, "qd": here["qd"]})
    with pytest.raises(TypeError, match="cuda"):
        answered(load("tied", "numpy"), row, asked)
    expected = answered(load("tied", "torch"), row, here)[0]
    arrays = {**taken(given(load, row, (3,)), False), "q": asked["q"]}
    inertias = {"I": torch.tensor([0.2, 0.3, 0.4], dtype=torch.float64).cuda()}
    of_samples = import_package(package_at("tied")).load("torch", parameters=inertias)
    for found in (answered(load("tied", "torch"), row, arrays)[0], answered(of_samples, row, asked)[0]):
        assert found.device.type == "cuda"
        torch.testing.assert_close(found[0].cpu(), expected[0], rtol=1e-12, atol=1e-12)


@on_a_gpu
@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
def test_compiled_calls_answer_on_a_gpu(load: Load) -> None:
    call = load("free", "torch").partial_torque
    motion = [torch.linspace(-1.0, 1.0, 256, dtype=torch.float64).view(64, 4).cuda() + m for m in range(3)]
    found = torch.compile(call)(*motion)
    assert found.device.type == "cuda"
    torch.testing.assert_close(found, call(*motion), rtol=1e-11, atol=1e-11)


def same(some: tuple[Any, ...], others: tuple[Any, ...]) -> bool:
    pairs = list(zip(some, others, strict=True))
    return all(a.shape == b.shape and np.allclose(a, b, rtol=1e-13, atol=1e-13) for a, b in pairs)


@for_every_row
def test_what_joints_have_of_their_own_counts_where_the_row_says(row: Call, load: Load) -> None:
    robot, bare, asked = load(of(row)), load(f"{of(row)} bare"), given(load, row, (3,))
    found, without = answered(robot, row, asked), answered(bare, row, asked)
    assert same(found, without) == (row.own == "not")
    if row.own == "alone":
        assert not np.any(without)
        assert all(value.any() for value in found), "each kind is a share"
    if row.own == "passive":
        assert same(answered(robot, row, asked, passive=False), without)
        assert "passive" in {**row.options, **row.chosen}


@for_every_row
def test_ties_are_cut_kept_or_refused_as_the_row_says(row: Call, load: Load) -> None:
    tied, free, asked = load("tied"), load("free"), given(load, row, (3,))
    if row.ties == "refused":
        refused(lambda: answered(tied, row, asked), r"call constraints\.forward_dynamics\(")
    elif row.ties == "cut":
        assert same(answered(tied, row, asked), answered(free, row, asked))
    elif "constraints" in row.options and row.key != "induced_reactions":
        cut = answered(free, row, asked)
        assert same(answered(tied, row, asked, constraints=False), cut)
        assert not same(answered(tied, row, asked), cut)
    else:
        refused(lambda: answered(free, row, asked), "no tie|nothing reacts")


@on_every_back_end
@pytest.mark.parametrize("row", [row for row in CALLS.values() if row.ties == "refused"], ids=key_of)
def test_no_back_end_moves_tied_joints_as_if_they_were_free(
    row: Call, backend: str, tensors: bool, load: Load
) -> None:
    asked = taken(given(load, row), tensors)
    refused(lambda: answered(load("tied", backend), row, asked), r"call constraints\.forward_dynamics\(")


def test_what_keeps_ties_keeps_them(load: Load) -> None:
    robot, asked = load("tied"), given(load, CALLS["simulate"], (3,))
    ties, q = robot.constraints, asked["q"]
    qd = ties.velocity(q, given(load, CALLS["constraints.velocity"], (3,))["yd"])
    rows, drift = ties.jacobian(q), (ties.jacobian_rate(q, qd) @ qd[..., None])[..., 0]
    qdd = ties.acceleration(q, qd, given(load, CALLS["constraints.acceleration"], (3,))["ydd"])
    induced = robot.induced_accelerations(q, qd, asked["tau"]).total
    moved = ties.forward_dynamics(q, qd, asked["tau"]).qdd
    np.testing.assert_allclose((rows @ qd[..., None])[..., 0], 0.0, atol=1e-12)
    for found in (qdd, induced, moved):
        np.testing.assert_allclose((rows @ found[..., None])[..., 0], -drift, atol=1e-11)
    end = robot.simulate(q, qd, INSTANTS, asked["tau"])
    np.testing.assert_allclose(ties.violation(end.q[-1]), 0.0, atol=1e-9)
    np.testing.assert_allclose((ties.jacobian(end.q[-1]) @ end.qd[-1][..., None])[..., 0], 0.0, atol=1e-9)


@pytest.mark.parametrize("which", ["free", "tied", CART, "planar3"])
def test_the_header_of_c_has_the_rows_and_nothing_else(which: str, package_at: Load, load: Load) -> None:
    directory, rigid, own = package_at(which), which != CART, which in ("free", "tied")
    header = next(directory.glob(f"c/{directory.name}.h")).read_text(encoding="utf-8")
    found = re.findall(rf"^(?:void|int) {directory.name}_(\w+)\(([^)]*)\)", header, re.MULTILINE)
    declared = {name: one for name, one in found if "double" in one}
    assert [name for name, one in found if "float" in one] == [f"{name}f" for name in declared]
    rows = {
        row.c: row
        for row in CALLS.values()
        if row.c
        and (rigid or not (row.rigid or row.one or row.key.startswith("constraints.")))
        and not (which == "tied" and row.ties == "refused")
        and (own or row.chosen.get("passive", True))
    }
    beside = {
        "passive_torque": own,
        "reactions": rigid and which != "tied",
        "partial_impedance": which != "tied",
        "cancel": which != "tied",
        "share_variances": rigid,
        "motion_variances_blocks": rigid,
        "frame_partial_impedance": rigid and which != "tied",
        "constrained_response": rigid,
        "constrained_response_of_links": rigid and own,
        "constrained_dynamics_of_links": rigid and own,
        **dict.fromkeys(OF_TIES, rigid),
        "simulate": rigid,
    }
    links = {f"link_{j + 1}" for j in range(load(which).N)}
    assert set(declared) - links == {name for name in {*rows, *BESIDE_IN_C} if beside.get(name, True)} - links
    assert set(declared) >= links
    for name, row in rows.items():
        arguments = declared[name]
        assert arguments.startswith("size_t count, ") != row.one
        read = re.findall(r"const (?:double|float) \*(\w+)", arguments)
        assert [a for a in read if a not in ("point", "p", "held_at")] == list(row.motion)


def test_the_page_of_calls_is_made_of_the_table() -> None:
    assert PAGE.read_text(encoding="utf-8") == page()
