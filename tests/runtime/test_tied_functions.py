"""C of tied joints through the native back end: against NumPy, one sample and many, in both precisions."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.motion import simulated
from linkwise_runtime.native.library import symbol

torch = pytest.importorskip("torch")
pytestmark = needs_compiler

ARM = """schema = 1
name = "arm"
gravity = [0.3, -0.5, -9.81]
parameters = {L = 0.42}
joint = [
  {name = "lift", type = "prismatic", parent = "base", child = "mast", xyz = [0.1, 0.2, 0.3]},
  {name = "turn", parent = "mast", child = "a", axis = [0, 0, 1], stiffness = 3.0, rest = 0.1, damping = 0.2},
  {name = "shoulder", parent = "a", child = "b", axis = [0, 1, 0], xyz = [0.1, 0, 0.2], armature = 0.05},
  {name = "elbow", parent = "b", child = "c", axis = [0.1, 1, 0], xyz = [0.4, 0, 0], friction = 0.3},
  {name = "wrist", parent = "c", child = "d", axis = [1, 0, 0.2], xyz = ["L", 0, 0]},
  {name = "slide", type = "prismatic", parent = "d", child = "e", axis = [1, 0.3, 0]},
  {name = "far", parent = "base", child = "f", axis = [0, 1, 0], xyz = [0.9, 0.2, 0.5]},
]
link = [
  {name = "mast", mass = 2.0, com = [0, 0, 0.1], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
  {name = "a", mass = 1.2, com = [0.1, 0.01, 0], inertia = {xx = 0.01, yy = 0.02, zz = 0.02}},
  {name = "b", mass = 1.7, com = [0.2, -0.02, 0], inertia = {xx = 0.01, yy = 0.05, zz = 0.06}},
  {name = "c", mass = 1.5, com = [0.2, 0, 0.03], inertia = {xx = 0.01, yy = 0.03, zz = 0.03}},
  {name = "d", mass = 0.5, com = [0.05, 0, 0], inertia = {xx = 0.004, yy = 0.003, zz = 0.002}},
  {name = "e", mass = 0.4, com = [0.03, 0, 0], inertia = {xx = 0.001, yy = 0.002, zz = 0.002}},
  {name = "f", mass = 0.7, com = [0, 0, 0.2], inertia = {xx = 0.01, yy = 0.01, zz = 0.003}},
]
"""
TIES = """
[[constraint]]
name = "rod"
type = "distance"
length = 0.6
first = {frame = "c", xyz = [0.1, 0.05, 0]}
second = {frame = "f", xyz = [0, 0, 0.3]}
[[constraint]]
name = "rack"
type = "coupling"
terms = {slide = 1.0, wrist = [0.01, -0.8, 0.1]}
"""
ON_MOTION = {
    "jacobian": 1,
    "jacobian_rate": 2,
    "velocity_map": 1,
    "velocity_accelerations": 2,
    "inverse_dynamics": 3,
    "partial_torque": 3,
    "coefficients": 2,
    "propagation": 3,
    "forces": 3,
    "force_coefficients": 2,
    "force_propagation": 3,
    "forward_dynamics": 3,
}
"""Calls, and how many arrays of motion each takes."""
EXACT, SINGLE = 1e-12, 3e-4


def package(folder: Path, text: str, kernel: str) -> ModuleType:
    (folder / "robot.toml").write_text(text)
    made = generate(
        read_system(folder / "robot.toml", Options("symbolic")), ["numpy", "torch", "native"], kernel=kernel
    )
    write_package(made, folder / "arm")
    return import_package(folder / "arm")


@pytest.fixture(scope="module", params=["straight", "loops"])
def tied(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return package(tmp_path_factory.mktemp(request.param), ARM + TIES, request.param)


@pytest.fixture(scope="module")
def free(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return package(tmp_path_factory.mktemp("free"), ARM, "loops")


def contacts(module: ModuleType, *kinds: str) -> list[Any]:
    about = {"point": (0.02, -0.01, 0.03), "axis": (0.2, 1.0, -0.4), "radius": 0.07}
    frames = ("e", "f", "d")
    return [module.Contact(frame, kind=kind, **about) for frame, kind in zip(frames, kinds, strict=False)]


def both(module: ModuleType, kinds: tuple[str, ...], at: Any = None) -> list[Any]:
    """Return the same constraints on NumPy and in C, at a parameter that is not the file's."""
    robots = [module.load(name, parameters={"L": 0.4}) for name in ("numpy", "native")]
    if not kinds:
        return [robot.constraints for robot in robots]
    exact = robots[0].constrained(contacts=contacts(module, *kinds), at=at)
    own = list(exact.independent)
    return [r.constrained(independent=own, contacts=contacts(module, *kinds), at=at) for r in robots]


def motion(exact: Any, samples: int = 9) -> list[Any]:
    draw = np.random.default_rng(3)
    q = exact.closed_position + draw.uniform(-0.05, 0.05, (samples, len(exact.closed_position)))
    return [exact.closed(q), *draw.uniform(-1.0, 1.0, (2, *q.shape))]


def parts(answer: Any) -> list[Any]:
    return list(answer) if isinstance(answer, tuple) else [answer]


def compare(found: Any, expected: Any, limit: float) -> None:
    for one, other in zip(parts(found), parts(expected), strict=True):
        assert one.shape == other.shape
        np.testing.assert_allclose(one, other, rtol=0, atol=limit * max(1.0, np.abs(other).max(initial=0.0)))


CASES: list[tuple[bool, tuple[str, ...]]] = [
    (True, ()),
    (True, ("point",)),
    (False, ("held",)),
    (False, ("hinged",)),
    (False, ("point", "rolling")),
    (False, ("rolling", "hinged")),
]
"""Cases: True where the robot has ties of its own, and kinds of contacts."""


@pytest.mark.parametrize(("has_ties", "kinds"), CASES)
def test_c_says_what_numpy_says(
    has_ties: bool, kinds: tuple[str, ...], tied: ModuleType, free: ModuleType
) -> None:
    module = tied if has_ties else free
    at = np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    exact, compiled = both(module, kinds, None if has_ties and not kinds else at if not has_ties else None)
    assert compiled.ties.rows(compiled._robot.backend).functions is not None
    given = motion(exact)
    for call, count in ON_MOTION.items():
        expected = getattr(exact, call)(*given[:count])
        compare(getattr(compiled, call)(*given[:count]), expected, EXACT)
        for _ in range(2):  # the second one goes past what reads the first
            alone = getattr(compiled, call)(*(a[4] for a in given[:count]))
            compare(
                alone,
                type(expected)(*(a[4] for a in expected)) if isinstance(expected, tuple) else expected[4],
                EXACT,
            )
        single = getattr(compiled, call)(*(a.astype(np.float32) for a in given[:count]))
        assert all(part.dtype == np.float32 for part in parts(single))
        compare(single, expected, SINGLE)
    compare(
        compiled.forward_dynamics(*given, passive=False), exact.forward_dynamics(*given, passive=False), EXACT
    )


@pytest.mark.parametrize(("has_ties", "kinds"), CASES)
def test_c_closes_what_numpy_closes(
    has_ties: bool, kinds: tuple[str, ...], tied: ModuleType, free: ModuleType
) -> None:
    at = None if has_ties else np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    exact, compiled = both(tied if has_ties else free, kinds, at)
    q = motion(exact)[0] + 0.03 * np.random.default_rng(4).uniform(-1.0, 1.0, (9, 7))
    compare(compiled.violation(q), exact.violation(q), EXACT)
    closed = compiled.closed(q)
    compare(closed, exact.closed(q), EXACT)
    compare(compiled.closed(q[2]), closed[2], EXACT)
    if has_ties or "rolling" in kinds:
        return
    held = motion(exact)[0]
    compare(compiled.violation(q, held_at=held), exact.violation(q, held_at=held), EXACT)
    compare(compiled.closed(q, held_at=held), exact.closed(q, held_at=held), 1e-10)


@pytest.mark.parametrize(("has_ties", "kinds"), CASES)
@pytest.mark.parametrize("passive", [True, False])
def test_c_induces_what_numpy_induces(
    passive: bool, has_ties: bool, kinds: tuple[str, ...], tied: ModuleType, free: ModuleType
) -> None:
    at = None if has_ties else np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    module = tied if has_ties else free
    exact, compiled = both(module, kinds, at)
    q, qd, tau = motion(exact)
    load = module.AppliedLoad("d", force=np.array([3.0, -2.0, 1.0]))
    for call in ("induced_accelerations", "induced_reactions"):

        def induced(one: Any, *state: Any, call: str = call) -> Any:
            asked = getattr(one._robot, call)
            return asked(*state, loads=[load], passive=passive, constraints=one)

        expected = induced(exact, q, qd, tau)
        compare(induced(compiled, q, qd, tau), expected, EXACT)
        compare(induced(compiled, q[3], qd[3], tau[3]), type(expected)(*(a[3] for a in expected)), EXACT)


def test_c_says_where_joints_follow_without_arrays(tied: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = tied.load("native")
    q, *_ = motion(robot.constraints)
    own = np.ones((len(q), len(robot.constraints.independent)))
    expected = tied.load("numpy").constraints.velocity(q, own)
    slide, far = robot.joint_names.index("slide"), q.copy()
    far[:, slide] += 12.0
    for of_arrays in ("tie_rows.RowsAt", "newton_closing.ties_at"):
        monkeypatch.setattr(
            f"linkwise_runtime.constraints.{of_arrays}", lambda *given: pytest.fail("arrays were asked")
        )
    compare(robot.constraints.velocity(q, own), expected, EXACT)
    compare(robot.constraints.closed(far), q, EXACT)


@pytest.mark.parametrize("call", [call for call in ON_MOTION if call != "inverse_dynamics"])
def test_c_answers_itself(call: str, tied: ModuleType) -> None:
    """Arrays would answer in its place, and as well; `inverse_dynamics` is a sum of `partial_torque`."""
    constraints = tied.load("native").constraints
    given = motion(tied.load("numpy").constraints)[: ON_MOTION[call]]
    assert constraints.answered(call, given, ("q", "qd", "tau")) is not None


def test_c_starts_anew_with_other_joints_where_its_own_do_not_close_ties(
    tied: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Arrays close ties before C is asked, so C is given a position where they are open."""
    q, started = motion(tied.load("numpy").constraints)[0][0], simulated._started
    q[2] -= 1.5
    with pytest.raises(ValueError, match="does not close"):
        tied.load("numpy").constraints.closed(q)
    expected = tied.load("numpy").simulate(q, 0.0 * q, [0.0, 1e-3])

    def opened(*given: Any) -> Any:
        equations, state = started(*given)
        return equations, state._replace(q=q)

    monkeypatch.setattr(simulated, "_started", opened)
    compare(tied.load("native").simulate(q, 0.0 * q, [0.0, 1e-3]).q, expected.q, EXACT)


def test_forces_by_cause_are_those_of_the_links(tied: ModuleType) -> None:
    for constraints in both(tied, ()):
        given = motion(constraints)
        c2, c1, g = constraints.force_propagation(*given)
        compare(c2.sum(-1) + c1.sum(-1) + g, constraints.forces(*given), EXACT)


def message(call: Callable[[], Any]) -> str:
    with pytest.raises(ValueError, match=r"\w") as told:
        call()
    return str(told.value)


def test_what_c_does_not_answer_is_told_as_numpy_tells_it(tied: ModuleType) -> None:
    exact, compiled = both(tied, ())
    q, qd, qdd = motion(exact)
    wrong = q + 0.2
    for given in ((wrong, qd, qdd), (wrong[0], qd[0], qdd[0])):
        told = message(lambda given=given: exact.coefficients(*given[:2]))  # type: ignore[misc]
        assert "is open by" in told
        assert told == message(lambda given=given: compiled.coefficients(*given[:2]))  # type: ignore[misc]
    own = ["lift", "turn", "shoulder", "wrist", "far"]
    exact, compiled = (tied.load(name).constrained(independent=own) for name in ("numpy", "native"))
    far = exact.closed_position + np.array([5.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    assert "does not close" in message(lambda: exact.closed(far))
    assert message(lambda: exact.closed(far)) == message(lambda: compiled.closed(far))
    with pytest.raises(ValueError, match="tau has shape"):
        compiled.forward_dynamics(q, qd, qdd[:, :2])


def test_more_contacts_than_c_takes_are_answered_by_arrays(free: ModuleType) -> None:
    robot = free.load("native")
    held = [free.Contact("f", kind="point", point=(0.0, 0.0, 0.01 * k), name=f"p{k}") for k in range(9)]
    many = robot.constrained(contacts=held)
    assert many.ties.rows(robot.backend).functions is None
    assert robot.constrained(contacts=held[:8]).ties.rows(robot.backend).functions is not None
    np.testing.assert_allclose(many.jacobian(np.zeros(7))[:3], many.jacobian(np.zeros((1, 7)))[0, :3])


@pytest.mark.parametrize(("has_ties", "kinds"), CASES)
def test_c_controls_what_numpy_controls(
    has_ties: bool, kinds: tuple[str, ...], tied: ModuleType, free: ModuleType
) -> None:
    module = tied if has_ties else free
    at = None if has_ties else np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    ties = both(module, kinds, at)
    q, qd, other = motion(ties[0])
    aim = module.Target(q=q[0] - 0.2, qd=other[1], qdd=other[2])
    half, links = module.Natural({"b": 0.5, "e": 0.0}), [module.Natural(plus=0.3)]
    # Few driven joints leave a motion to itself, and many share by their weights.
    few, more = [ties[0].independent[-1]], [name for name in ties[0]._robot.joint_names if name != "turn"]
    for asked in (
        {"stiffness": 3.0, "damping": links[0]},
        {"stiffness": 3.0, "inertia": half, "damping": half, "friction_width": 0.1},
        {"stiffness": 3.0, "inertia": half, "actuated": few},
        {"stiffness": 3.0, "actuated": more, "torque_weight": [1.0, 3.0, 0.5, 2.0, 1.0, 4.0]},
    ):
        exact, compiled = (one._robot.partial_impedance(**asked, constraints=one) for one in ties)
        single = ties[1]._robot.partial_impedance(**asked, constraints=ties[1])
        for call in ("__call__", "acceleration", "forces"):
            for s in range(3):
                given = (q[s], qd[s], aim, other[3])
                expected = getattr(exact, call)(*given)
                compare(getattr(compiled, call)(*given), expected, EXACT)
                part = [a.astype(np.float32) for a in (*given[:2], *aim[:3], given[3])]
                found = getattr(single, call)(*part[:2], module.Target(*part[2:5]), part[5])
                assert found.dtype == np.float32
                compare(found, expected, SINGLE)
        assert {key[0] for of_one in compiled._of_one.values() for key in of_one._of_one.free} == {
            "tau",
            "qdd",
            "forces",
        }
    known = ties[0]._robot.kinematics
    rows = {name: known.jacobian(q[0], name) @ ties[0].velocity_map(q[0]) for name in known.frames}
    moving = [name for name, mapped in rows.items() if np.abs(mapped).max() > 0.01]
    for frame, natural in zip(moving[-2:], (1.0, 0.4), strict=False):
        row = ("rx", "ry", "rz", "x", "y", "z")[np.abs(rows[frame]).max(1).argmax()]
        part = module.Natural(natural, plus=0.5)
        aimed = module.FrameImpedance(frame, part, part, 40.0, (row,), (0.01, 0.02, -0.03))
        exact, compiled = (
            one._robot.partial_impedance(stiffness=2.0, frame=aimed, constraints=one) for one in ties
        )
        pose = known.pose(q[7], frame)
        aim = module.Target(q[0], None, other[2], pose, np.full(6, 0.2), np.full(6, -0.3))
        for call in ("__call__", "acceleration", "forces"):
            for s in range(3):
                given = (q[s], qd[s], aim, other[3])
                expected = getattr(exact, call)(*given)
                with pytest.MonkeyPatch.context() as patch:  # arrays have no part in it
                    patch.setattr(
                        type(compiled), "_followed", lambda *asked: pytest.fail("arrays were asked")
                    )
                    compare(getattr(compiled, call)(*given), expected, EXACT)
        assert sum(len(of_one._of_one.free) for of_one in compiled._of_one.values()) == 3
    for driven in (None, few):
        exact, compiled = (
            one._robot.cancel({(None, "e", None, None)}, constraints=one, actuated=driven) for one in ties
        )
        for call, given in (("__call__", (q, qd, other, None, other)), ("acceleration", (q, qd, other))):
            row = [None if a is None else a[5] for a in given]
            compare(getattr(compiled, call)(*row), getattr(exact, call)(*row), EXACT)


class GripStruct(ctypes.Structure):
    """The struct NAME_grip of double."""

    _fields_ = (("contact", ctypes.c_int), ("friction", ctypes.c_double), ("normal", ctypes.c_double * 3))


def test_c_tells_which_contacts_keep(free: ModuleType) -> None:
    """On a slope: what pulls, slips, is not there, or does not touch at one point."""
    at, normal = np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2]), np.array([0.1, 0.0, 0.9])
    held = [both(free, kinds, at)[1] for kinds in (("point", "rolling"), ("rolling", "hinged"))]
    functions = [one.ties.rows(one._robot.backend).functions for one in held]
    keep = symbol(functions[0]._calls.sources, "contacts_keep", "f8")

    def told(forces: Any, second: int = 1, of: int = 0) -> int:
        grips = (GripStruct * 2)(
            *(GripStruct(k, 0.5, (ctypes.c_double * 3)(*normal)) for k in (0, second)),
        )
        struct = functions[of].settings(np.dtype(float)).struct
        found: int = keep(
            ctypes.c_size_t(2), ctypes.byref(struct), grips, ctypes.c_void_p(forces.ctypes.data)
        )
        return found

    across = np.cross(normal, [0.0, 1.0, 0.0])
    unit, across = normal / np.linalg.norm(normal), across / np.linalg.norm(across)
    for first, second, expected in (
        (10.0 * unit + 4.9 * across, unit, 0),
        (10.0 * unit + 5.1 * across, unit, 1),
        (10.0 * unit, 0.6 * across + unit, 2),
        (10.0 * unit, -0.1 * unit, 2),
        (10.0 * unit, np.full(3, np.nan), 2),
    ):
        assert told(np.concatenate([first, second])) == expected
    pressed = np.concatenate([unit, np.zeros(5)])
    assert told(pressed, 2) == told(pressed, -1) == told(pressed, of=1) == -2


@pytest.mark.parametrize("backend", ["numpy", "torch", "native"])
def test_redundant_rows_share_by_their_weights(backend: str, free: ModuleType) -> None:
    """Least lambda' W lambda of all forces lambda + N z of the same torques, A' N = 0."""
    robot, at = free.load(backend), np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    held = [
        free.Contact("d", kind="held", name="d"),
        free.Contact("e", kind="hinged", axis=(0, 0, 1), name="e"),
    ]
    plain = robot.constrained(contacts=held, at=at)
    weight = np.random.default_rng(1).uniform(0.2, 5.0, 11)
    q, qd, qdd = (np.tile(a, (2, 1)) for a in (at, 0.1 + at, at - 0.2))
    given = [torch.tensor(a) for a in (q, qd, qdd)] if backend == "torch" else [q, qd, qdd]
    for asked, w in (
        (weight, weight),
        ({"e": 4.0}, np.array([1.0] * 6 + [4.0] * 5)),
        ({"e": 1e6}, np.array([1.0] * 6 + [1e6] * 5)),
        ([1.0] * 11, np.ones(11)),
    ):
        weighed = robot.constrained(
            independent=list(plain.independent), contacts=held, at=at, force_weight=asked
        )
        rows = np.asarray(plain.jacobian(given[0]))[0]
        u, values, _ = np.linalg.svd(rows)
        free_of = u[:, (values > 1e-9).sum() :]
        known, found = (np.asarray(one.forces(*given))[0] for one in (plain, weighed))
        z = np.linalg.solve(free_of.T * w @ free_of, free_of.T * w @ known)
        near = 1e-12 * (w.max() / w.min()) ** 0.5 + 1e-11  # by as much are rows of A_d farther apart
        np.testing.assert_allclose(found, known - free_of @ z, rtol=0, atol=near)
        moved = [one.forward_dynamics(*given) for one in (plain, weighed)]
        np.testing.assert_allclose(*(np.asarray(one.qdd) for one in moved), rtol=0, atol=1e-10)
        if backend == "native":
            assert weighed.ties.rows(robot.backend).functions is not None
            single = np.asarray(weighed.forces(*(a.astype(np.float32) for a in given)))[0]
            np.testing.assert_allclose(single, found, rtol=0, atol=1e-3 * np.abs(found).max())


def test_weights_of_forces_are_refused_in_words(free: ModuleType) -> None:
    robot = free.load("numpy")
    held = [free.Contact("d", kind="held", name="hand")]
    with pytest.raises(ValueError, match=r"of which some are more than 1e\+06 times others"):
        robot.constrained(contacts=held, force_weight=[1.0] * 5 + [1e7])
    for wrong in (
        [1.0],
        [0.0] * 6,
        "a",
        {"hand": True},
        {"hand": [1.0]},
        {"foot": 1.0},
        {"hand": -1.0},
        {"hand": "a"},
        [np.nan] * 6,
    ):
        with pytest.raises(
            ValueError, match=r"force_weight is .*; give a number above 0 for each of the 6 rows"
        ):
            robot.constrained(contacts=held, force_weight=wrong)


def test_c_refuses_a_wrong_number_of_undriven_motions(free: ModuleType) -> None:
    at = np.array([0.1, 0.3, 0.5, -0.7, 0.4, 0.05, 0.2])
    ties = both(free, ("point", "rolling"), at)[1]
    targets = ties._robot.partial_impedance(constraints=ties)._joints.targets
    functions, given = ties.ties.rows(ties._robot.backend).functions, {"q": at, "qd": 0.1 * at}
    own = [ties._robot.joint_names.index(name) for name in ties.independent]
    for driven, undriven, answers in (
        (range(7), 0, True),
        (range(7), 1, False),
        (own, 0, True),
        (own, 1, False),
        ([], len(own), False),
    ):
        made = functions.controller(targets, None, driven, np.ones(len(driven)), undriven)
        assert (made.torque(given) is not None) == answers, (driven, undriven)
