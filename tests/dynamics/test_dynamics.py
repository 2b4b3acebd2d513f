"""Two derivations of one thing: the rigid-link rule, and Euler–Lagrange on the energy of the same link."""

import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from conftest import DATA, LOCKED_FINGERS, PANDA
from helpers.answers import random_states, relative_error
from helpers.evaluation import evaluate
from linkwise import Options, generate, read_system
from linkwise.dynamics.derive import derive, link_forms
from linkwise.dynamics.frame_search import MAX_AXES, FrameSearch, _spread
from linkwise.dynamics.joint_chain import CommonAxes, JointChain
from linkwise.dynamics.link_forms import LinkForms, lowering
from linkwise.dynamics.link_motion import Origin
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import RigidSystem

BLOCKS = ("acceleration", "velocity", "gravity", "torque", "decomposed_torque", "position_gradient")


def numbers(forms: LinkForms, block: str, states: list[dict[str, float]]) -> np.ndarray:
    values = getattr(forms, block).values()
    return np.array([evaluate(forms.graph, values, state) for state in states])


def states_of_three(samples: int) -> list[dict[str, float]]:
    return [
        {
            f"{kind}{k + 1}": row[k]
            for kind, row in zip(("q", "qd", "qdd"), rows, strict=True)
            for k in range(3)
        }
        for rows in zip(*random_states(3, samples), strict=True)
    ]


@pytest.mark.parametrize(("gravity", "weight"), [("[1, 0, 0]", sp.sin), ("[0, -1, 0]", sp.cos)])
def test_the_energy_of_a_pendulum_is_that_of_the_textbook(
    gravity: str, weight: sp.Function, tmp_path: Path
) -> None:
    """tau = (I + m r^2) qdd + m g r times the sine of the angle from the way that a stone falls."""
    (tmp_path / "pendulum.toml").write_text(
        f"schema = 1\ngravity = {gravity}\n"
        '[[link]]\nname = "bob"\nmass = 2\ncom = [0.5, 0, 0]\ninertia = { xx = 0.25, yy = 0.25, zz = 0.25 }\n'
        '[[joint]]\nname = "pivot"\nparent = "base"\nchild = "bob"\ntype = "revolute"\naxis = [0, 0, 1]\n'
    )
    system = read_system(tmp_path / "pendulum.toml")
    (joint,) = system.coordinates
    (torque,) = partial_torques(system, 0).values()
    assert sp.expand(torque - (0.75 * joint.qdd + weight(joint.q))).evalf(12, chop=True) == 0


@pytest.mark.parametrize("block", BLOCKS)
def test_rigid_link_rule_is_euler_lagrange_of_the_energy(block: str) -> None:
    system = read_system(DATA / "skew.toml")
    states = states_of_three(10)
    by_rule, by_energy = [], []
    for link in range(3):
        rule, energy = link_forms(system, link), link_forms(system, link, "energy")
        assert rule.path == energy.path
        by_rule.append(numbers(rule, block, states))
        by_energy.append(numbers(energy, block, states))
    assert relative_error(np.hstack(by_rule), np.hstack(by_energy)) <= 1e-12


FRAMES = [
    (CommonAxes(0), Origin(0), ("the base's", "the base's, at rest")),
    (
        CommonAxes(1),
        Origin(2),
        ("of the frame that joint 1 moves", "where joint 2 is at the instant, at rest"),
    ),
    (CommonAxes(3, before=True), Origin(1), ("of the frame before joint 3 moves", "where joint 1 is at ")),
    (
        CommonAxes(2),
        Origin(by_points=True),
        ("of the frame that joint 2", "the link's centre of mass, moving"),
    ),
    (
        CommonAxes(2, before=True),
        Origin(),
        ("of the frame before joint 2", "the link's centre of mass, moving"),
    ),
]


@pytest.mark.parametrize(("axes", "origin", "words"), FRAMES)
def test_every_common_frame_gives_the_same_numbers_and_says_which_it_is(
    axes: CommonAxes, origin: Origin, words: tuple[str, str]
) -> None:
    system = read_system(DATA / "skew.toml")
    assert isinstance(system, RigidSystem)
    states = states_of_three(3)
    rule, energy = FrameSearch(system, 2).build(axes, origin), link_forms(system, 2, "energy")
    assert all(found.startswith(said) for found, said in zip(rule.frame, words, strict=True))
    assert rule.frame[1].endswith("square root of its mass, 0.4 kg") == (origin.frame is None)
    for block in BLOCKS:
        assert relative_error(numbers(rule, block, states), numbers(energy, block, states)) <= 1e-12, block


def test_an_origin_beside_the_common_axes_own_is_taken_where_it_costs_less() -> None:
    system = read_system(DATA / "skew.toml")
    assert isinstance(system, RigidSystem)
    found = list(FrameSearch(system, 2).framed(MAX_AXES))
    own = min(cost for cost, axes, origin in found if axes.frame == origin.frame)
    beside = min(cost for cost, axes, origin in found if axes.frame != origin.frame)
    assert beside < own
    assert link_forms(system, 2, "rule").decomposition_cost <= beside


def test_a_decomposition_is_of_all_four_quantities() -> None:
    forms = link_forms(read_system("planar3"), 2, "rule")
    parts = (forms.acceleration, forms.velocity, forms.gravity, forms.decomposed_torque)
    assert list(forms.decomposition()) == [node for part in parts for node in part.values()]
    assert [len(part) for part in parts] == [6, 9, 3, 3]


def test_sums_of_a_torque_are_called_by_joint_and_cause() -> None:
    forms = generate(read_system("planar3"), ["numpy"])["forms/link_2.py"]
    assert {"c1_1_1", "tau1_1", "tau2_1"} <= set(re.findall(r"^ +(\w+) = ", forms, re.MULTILINE))


@pytest.mark.parametrize(("count", "most"), [(3, 4), (5, 4), (10, 4), (30, 3), (31, 7)])
def test_frames_are_looked_for_near_the_base_and_as_far_as_the_last_joint(count: int, most: int) -> None:
    found = _spread(range(count), most)
    assert len(found) == min(count, most)
    assert found[: most // 2] == list(range(min(count, most // 2)))
    assert found[-1] == count - 1
    assert found == sorted(set(found))


def test_deriving_says_how_far_it_is() -> None:
    said: list[tuple[str, int, int]] = []
    derive(read_system("planar2"), lambda *progress: said.append(progress))
    assert said == [("derive", 0, 2), ("derive", 1, 2), ("derive", 2, 2)]


def test_joints_that_follow_one_coordinate_have_labels_of_their_own() -> None:
    system = read_system(DATA / "skew.toml")
    assert isinstance(system, RigidSystem)
    lower, x = lowering(system)
    turning, other = system.links[2].joints[0], system.links[2].joints[2]
    joints = [turning] * 30 + [other] * 2
    chain = JointChain(lower, joints, (0.0, 0.0, 0.0), CommonAxes(0), x)
    labels = list(chain.label.values())
    assert labels[:3] + labels[25:] == ["1", "1b", "1c", "1z", "1aa", "1ab", "1ac", "1ad", "3", "3b"]
    assert len(set(labels)) == len(labels)


@pytest.mark.parametrize(
    ("robot", "options", "most"),
    [
        ("planar3", Options(), 160),
        (DATA / "skew.toml", Options(), 540),
        (PANDA, Options(lock=LOCKED_FINGERS), 4700),
    ],
    ids=["planar3", "skew", "panda"],
)
def test_full_decomposition_stays_cheap(robot: str, options: Options, most: int) -> None:
    assert sum(forms.decomposition_cost for forms in derive(read_system(robot, options))) <= most
