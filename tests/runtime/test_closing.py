"""Positions where loops close without a guess, kept by generate and held against MuJoCo's own residuals."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import LinkwiseError, Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact

mujoco = pytest.importorskip("mujoco")

MJCF = """<mujoco><compiler angle="radian"/><worldbody>{bodies}</worldbody>
<equality>{equalities}</equality>{more}</mujoco>"""
INERTIAL = '<inertial pos="{at}" mass="{mass}" diaginertia="0.01 0.02 0.02"/>'
PIN = '<connect site1="one" site2="other"/>'
KNEE = {
    "translation2": ("0 1 0", (4.1e-05, 0.0109, -0.0543, 0.0324, -0.0053)),
    "translation1": ("1 0 0", (-0.0053, -0.0683, 0.0572, -0.0233, 0.0036)),
    "rotation2": ("0 1 0", (0.0, 0.01, 0.1, -0.05, 0.007)),
    "rotation3": ("1 0 0", (0.0, 0.02, 0.01, -0.01, 0.0)),
    "beta_translation2": ("0 1 0", (-0.01, -0.018, 0.006, 0.0, 0.0)),
    "beta_translation1": ("1 0 0", (0.05, -0.01, -0.008, 0.002, 0.0)),
    "beta_rotation1": ("0 0 1", (0.01, -0.6, -0.2, 0.05, 0.0)),
}
"""Axes, and polynomials of the knee's angle by which the tibia and the patella slide and turn."""


def joint(name: str, axis: str = "0 0 1", kind: str = "hinge") -> str:
    return f'<joint name="{name}" type="{kind}" axis="{axis}"/>'


def body(name: str, place: str, joints: str, inside: str = "", mass: float = 1.0) -> str:
    inertial = INERTIAL.format(at="0.1 0.01 0", mass=mass)
    return f'<body name="{name}" pos="{place}">{joints}{inertial}{inside}</body>'


def site(name: str, place: str) -> str:
    return f'<site name="{name}" pos="{place}"/>'


def bars(crank: float, rod: float, rocker: float, ground: str) -> str:
    coupler = body("b", f"{crank} 0 0", joint("rod"), site("one", f"{rod} 0 0"))
    bodies = body("a", "0 0 0", joint("crank"), coupler)
    bodies += body("c", ground, joint("rocker"), site("other", f"{rocker} 0 0"))
    return MJCF.format(bodies=bodies, equalities=PIN, more="")


def slider(axis: str, place: str) -> str:
    rod = body("b", "0.1 0 0", joint("rod"), site("one", "0.3 0 0"))
    bodies = body("a", "0 0 0", joint("crank"), rod)
    bodies += body("c", place, joint("piston", axis, "slide"), site("other", "0 0 0"))
    return MJCF.format(bodies=bodies, equalities=PIN, more="")


def five_bars() -> str:
    left = body("b", "0.2 0 0", joint("left_elbow"), site("one", "0.25 0 0"))
    right = body("d", "0.21 0 0", joint("right_elbow"), site("other", "0.26 0 0"))
    bodies = body("a", "0 0 0", joint("left"), left) + body("c", "0.15 0 0", joint("right"), right)
    return MJCF.format(bodies=bodies, equalities=PIN, more="")


def three_arms() -> str:
    """A plate on three arms of two bars, which are held apart from it as a delta's are."""
    plate = "".join(joint(axis, kind="slide", axis=to) for axis, to in zip("xyz", AXES, strict=True))
    bodies, equalities, corners = "", "", ""
    for k, angle in enumerate((0.0, 2.1, 4.2)):
        c, s = np.cos(angle), np.sin(angle)
        ball = "".join(joint(f"{way}{k}", axis=to) for way, to in zip("uv", AXES[:2], strict=True))
        rod = body(f"rod{k}", f"{0.2 * c} {0.2 * s} 0", ball, site(f"tip{k}", "0 0 -0.5"))
        bodies += body(f"arm{k}", f"{0.1 * c} {0.1 * s} 0", joint(f"arm{k}", f"{-s} {c} 0"), rod)
        corners += site(f"corner{k}", f"{0.05 * c} {0.05 * s} 0")
        equalities += f'<connect site1="tip{k}" site2="corner{k}"/>'
    return MJCF.format(
        bodies=bodies + body("plate", "0 0 -0.4", plate, corners), equalities=equalities, more=""
    )


AXES = "1 0 0", "0 1 0", "0 0 1"


def knee(more: str = "") -> str:
    """A leg as musculoskeletal models have it: slides before the knee, and a muscle over all of it."""
    own, kneecap = (
        "".join(
            joint(f"knee_r_{name}", axis, "slide" if "trans" in name else "hinge")
            for name, (axis, _) in KNEE.items()
            if ("beta" in name) == is_beta
        )
        for is_beta in (False, True)
    )
    moved = own.replace('"knee_r_rotation2"', '"knee_r" axis="0 0 -1"/><joint name="knee_r_rotation2"')
    talus = body("talus", "0 -0.4 0", joint("ankle", "-0.105 -0.174 0.979"))
    tibia = body("tibia", "0 -0.4 0", moved, talus + site("below", "0.02 -0.05 0.02"))
    inside = site("above", "0 -0.2 0.02") + tibia + body("patella", "0 -0.4 0", kneecap, mass=0.1)
    bodies = body("femur", "0 0 1", "".join(joint(f"hip{k}", to) for k, to in enumerate(AXES)), inside)
    equalities = "".join(
        f'<joint joint1="knee_r_{name}" joint2="knee_r" polycoef="{" ".join(map(str, factors))}"/>'
        for name, (_, factors) in KNEE.items()
    )
    tendon = '<spatial name="t"><site site="above"/><site site="below"/></spatial>'
    muscle = '<muscle name="vasti" tendon="t" lengthrange="0.1 0.5"/>'
    more = f"<tendon>{tendon}</tendon><actuator>{muscle}{more}</actuator>"
    return MJCF.format(bodies=bodies, equalities=equalities, more=more)


MECHANISMS = {
    "crank and rocker": bars(0.12, 0.31, 0.24, "0.28 0 0"),
    "two rockers": bars(0.3, 0.7, 0.5, "0.6 0.1 0"),
    "parallelogram": bars(0.2, 0.4, 0.2, "0.4 0 0"),
    "drag link": bars(0.3, 0.28, 0.32, "0.1 0 0"),
    "short rod": bars(0.25, 0.12, 0.3, "0.2 -0.2 0.0"),
    "slider and crank": slider("1 0 0", "0 0 0"),
    "slider across": slider("0 1 0", "0.25 0 0"),
    "five bars": five_bars(),
    "three arms": three_arms(),
    "knee": knee(),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Any, Any]]:
    """A mechanism's NumPy robot, and MuJoCo's model."""
    folder, known = tmp_path_factory.mktemp("closing"), dict[str, Any]()

    def make(name: str) -> tuple[Any, Any]:
        if name not in known:
            path = folder / f"m{len(known)}.xml"
            path.write_text(MECHANISMS[name])
            write_package(generate(read_system(path, Options()), ["numpy"]), folder / path.stem)
            robot = import_package(folder / path.stem).load("numpy")
            known[name] = robot, mujoco.MjModel.from_xml_path(str(path))
        return known[name]

    return make


def open_by(model: Any, q: Any) -> float:
    """The largest residual of MuJoCo's equality constraints at positions (S, n)."""
    assert [model.joint(k).name for k in range(model.njnt)]
    data, largest = mujoco.MjData(model), 0.0
    for one in q:
        data.qpos[:] = one
        mujoco.mj_forward(model, data)
        rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        assert rows.any()
        largest = max(largest, float(np.abs(data.efc_pos[rows]).max()))
    return largest


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_closes_without_a_guess_and_stays_on_its_branch(
    name: str, made: Callable[[str], tuple[Any, Any]]
) -> None:
    robot, model = made(name)
    constraints = robot.constraints
    assert constraints.closed_position.shape == (robot.n,)
    assert open_by(model, [constraints.closed_position]) < 1e-9
    own = [robot.joint_index(joint) for joint in constraints.independent]
    turn = np.linspace(0.0, 2.0 * np.pi, 101)[:, None] + np.arange(len(own))
    # It may stand near a dead point, which is not to be passed.
    y = constraints.closed_position[own] + 0.15 * (np.sin(turn) - np.sin(turn[:1]))
    q = constraints.closed(y)
    np.testing.assert_array_equal(q[:, own], y)
    assert open_by(model, q) < 1e-9
    assert np.abs(np.diff(q, axis=0)).max() < 0.1
    np.testing.assert_allclose(q[-1], q[0], atol=1e-9)
    np.testing.assert_allclose(q[0], constraints.closed_position, atol=1e-9)


def test_the_joint_that_the_file_has_others_follow_is_independent(tmp_path: Path) -> None:
    def chosen(text: str) -> list[str]:
        (tmp_path / "robot.xml").write_text(text)
        robot: Any = read_system(tmp_path / "robot.xml", Options())
        return _independent(robot)

    hips = ["hip0", "hip1", "hip2"]
    assert chosen(knee()) == [*hips, "knee_r", "ankle"]
    # What a motor drives goes before: at a place where the knee follows it, too.
    driven = '<motor joint="knee_r_beta_rotation1"/>'
    assert chosen(knee(driven)) == [*hips, "ankle", "knee_r_beta_rotation1"]
    # A wheel turns by 50 rad for each m: where a column is small does not make its joint less of a follower.
    rack = body("rack", "0 0 0", joint("push", "1 0 0", "slide"), body("wheel", "0 0 0", joint("turn")))
    turned = '<joint joint1="turn" joint2="push" polycoef="0 50 0 0 0"/>'
    assert chosen(MJCF.format(bodies=rack, equalities=turned, more="")) == ["push"]
    pushed = '<joint joint1="push" joint2="turn" polycoef="0 0.1 0 0 0"/>'
    assert chosen(MJCF.format(bodies=rack, equalities=pushed, more="")) == ["turn"]
    pulled = '<tendon><fixed name="f"><joint joint="push" coef="1"/></fixed></tendon><actuator>{}</actuator>'
    more = pulled.format('<motor tendon="f"/>')
    assert chosen(MJCF.format(bodies=rack, equalities=pushed, more=more)) == ["push"]


def _independent(system: Any) -> list[str]:
    robot = system.robot
    return [robot.coordinates[k].name for k in robot.independent]


def test_contacts_leave_independent_what_the_file_has(made: Callable[[str], tuple[Any, Any]]) -> None:
    robot, _ = made("knee")
    held = robot.constrained(contacts=[Contact("talus", "point")])
    follow = [f"knee_r_{name}" for name in KNEE]
    assert set(follow) <= set(held.dependent)
    assert len(held.independent) == 2


def test_a_guess_that_does_not_close_names_a_mend_that_does(made: Callable[[str], tuple[Any, Any]]) -> None:
    robot, model = made("two rockers")
    constraints, q = robot.constraints, np.zeros((4, 3))
    with pytest.raises(
        ValueError, match=r"or give closed\(q\[\.\.\., \[0\]\]\) the independent joints alone$"
    ):
        constraints.closed(q)
    assert open_by(model, constraints.closed(q[..., [0]])) < 1e-9
    with pytest.raises(ValueError, match=r"^the joints that follow rocker cannot be led there, but \d+"):
        robot.constrained(["rocker"]).closed([np.pi])
    with pytest.raises(ValueError, match=r"^start is where joints are led from that q does not have"):
        constraints.closed(constraints.closed_position, start=constraints.closed_position)


def test_the_choice_that_a_message_gives_is_whole(tmp_path: Path) -> None:
    links = "".join(body(f"l{k}", f"0 {k} 0", joint(f"j{k}")) for k in range(12))
    path = tmp_path / "many.xml"
    path.write_text(
        MJCF.format(bodies=links, equalities='<joint joint1="j0" joint2="j1" polycoef="0 1 0 0 0"/>', more="")
    )
    with pytest.raises(LinkwiseError) as refused:
        read_system(path, Options(independent=("j3",)))
    asked = str(refused.value).partition("choose --independent ")[2].removesuffix(", say")
    robot: Any = read_system(path, Options(independent=(asked,)))
    assert _independent(robot) == [f"j{k}" for k in range(1, 12)]


def test_a_motion_starts_from_the_independent_joints_alone(made: Callable[[str], tuple[Any, Any]]) -> None:
    robot, model = made("crank and rocker")
    start, speed = np.array([0.4]), np.array([1.5])
    moved = robot.simulate(start, speed, [0.0, 0.01, 0.02])
    whole = robot.constraints.closed(start)
    again = robot.simulate(whole, robot.constraints.velocity(whole, speed), [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(moved.q, again.q)
    np.testing.assert_array_equal(moved.qd, again.qd)
    assert open_by(model, moved.q) < 1e-9


def test_a_gap_in_a_batch_leaves_a_gap_and_the_other_samples_close(
    made: Callable[[str], tuple[Any, Any]],
) -> None:
    constraints = made("crank and rocker")[0].constraints
    y = np.array([[0.1], [np.nan], [0.9]])
    q = constraints.closed(y)
    assert np.isnan(q[1]).all()
    np.testing.assert_allclose(q[::2], constraints.closed(y[::2]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("backend", ["torch", "native"])
def test_back_ends_lead_joints_alike_and_gradients_run_through(backend: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    (tmp_path / "bars.xml").write_text(MECHANISMS["crank and rocker"])
    write_package(generate(read_system(tmp_path / "bars.xml", Options()), ["numpy", backend]), tmp_path / "p")
    package = import_package(tmp_path / "p")
    y = np.array([[0.1], [0.9]])
    expected = package.load("numpy").constraints.closed(y)
    constraints = package.load(backend).constraints
    np.testing.assert_allclose(constraints.closed(y), expected, atol=1e-9)
    given = torch.from_numpy(y).requires_grad_()
    (slope,) = torch.autograd.grad(constraints.closed(given)[:, 2].sum(), given)
    found = package.load("numpy").constraints.velocity_map(expected)[:, 2]
    np.testing.assert_allclose(slope, found, atol=1e-9)
