"""`linkwise check` holds what constraints answer against motion that it works out in another way."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from linkwise import Options, check_package, generate, read_system, write_package
from linkwise.check import simulation_checks
from linkwise.check.constraint_checks import HeldContacts, loop_calls
from linkwise.check.impedance_checks import tied_impedance_calls
from linkwise.check.parametric_tree import tree_with
from linkwise.check.simulation_checks import simulated_motion, simulation_calls
from linkwise.oracle.loop_reference import LoopReference, loop_reference
from linkwise.oracle.states import random_states
from linkwise.package.load import Package, load_package
from linkwise.package.manifest import Manifest

ROBOT = """schema = 1
name = "tied"
gravity = [0.5, -9.81, 0.3]
parameters = {L = 0.7, m = 2.0}
joint = [
  {name = "crank", parent = "base", child = "a"},
  {name = "knee", parent = "a", child = "b", xyz = [0.3, 0, 0]},
  {name = "rocker", parent = "base", child = "c", xyz = [0.6, 0.1, 0]},
  {name = "pinned", type = "fixed", parent = "c", child = "tip", xyz = [0.5, 0, 0]},
  {name = "gear", parent = "base", child = "d"},
]
link = [
  {name = "tip"},
  {name = "a", mass = 1.2, com = [0.15, 0.01, 0], inertia = {xx = 0.01, yy = 0.02, zz = 0.02}},
  {name = "b", mass = "m", com = [0.3, -0.02, 0], inertia = {xx = 0.01, yy = 0.05, zz = 0.06}},
  {name = "c", mass = 1.5, com = [0.2, 0, 0], inertia = {xx = 0.01, yy = 0.03, zz = 0.03}},
  {name = "d", mass = 1.5, com = [0.0, 0.1, 0], inertia = {xx = 0.01, yy = 0.03, zz = 0.03}},
]
constraint = [
  {name = "pin", type = "hinge", first = {frame = "b", xyz = ["L", 0, 0]}, second = {frame = "tip"}},
  {name = "mesh", type = "coupling", terms = {crank = [0.1, 1, 0.2], gear = 2}},
]
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Package:
    folder = tmp_path_factory.mktemp("tied")
    (folder / "robot.toml").write_text(ROBOT)
    system = read_system(folder / "robot.toml", Options("symbolic"))
    write_package(generate(system, ["numpy"], kernel="loops"), folder / "tied")
    return load_package(folder / "tied", Manifest.read(folder / "tied"))


@pytest.fixture(scope="module")
def reference(package: Package) -> LoopReference:
    tree = package.manifest.tree
    assert tree is not None
    found = loop_reference(package.manifest, tree, random_states(package.manifest.joints, 60))
    assert found is not None
    return found


def test_states_are_found_in_which_loops_close(reference: LoopReference) -> None:
    assert len(reference.states.q) >= 6
    assert np.abs(reference.equations.violation(reference.states.q)).max() < 1e-11


@pytest.mark.parametrize(("mass", "passes"), [(2.0, [True] * 5), (2.001, [True, *[False] * 4])])
def test_another_mass_is_found_in_shares_and_forces(
    package: Package, reference: LoopReference, mass: float, passes: list[bool]
) -> None:
    model = package.load("numpy", {"L": 0.7, "m": mass})
    assert [result.held for result in loop_calls("numpy", model, reference)] == passes


@pytest.mark.parametrize(("mass", "passes"), [(2.0, [True] * 5), (2.001, [True, *[False] * 4])])
def test_loops_of_rounded_angles_are_checked_where_they_are_open_least(
    mass: float, passes: list[bool], tmp_path: Path
) -> None:
    text = ROBOT.replace('child = "a"', 'child = "a", rpy = [1.5708, 0, 0]')
    text = text.replace("xyz = [0.6, 0.1, 0]", "xyz = [0.6, 0, 0.1], rpy = [1.570796, 0, 0]")
    (tmp_path / "robot.toml").write_text(text)
    system = read_system(tmp_path / "robot.toml", Options("symbolic"))
    write_package(generate(system, ["numpy"], kernel="loops"), tmp_path / "tied")
    package = load_package(tmp_path / "tied", Manifest.read(tmp_path / "tied"))
    tree = package.manifest.tree
    assert tree is not None
    found = loop_reference(package.manifest, tree, random_states(package.manifest.joints, 60))
    assert found is not None
    assert len(found.states.q) >= 6
    assert np.abs(found.equations.violation(found.states.q)).max(-1).min() > 1e-7
    model = package.load("numpy", {"L": 0.7, "m": mass})
    assert [result.held for result in loop_calls("numpy", model, found)] == passes


@pytest.mark.parametrize(("mass", "passes"), [(2.0, True), (2.001, False)])
def test_another_mass_is_found_in_controllers(
    package: Package, reference: LoopReference, mass: float, passes: bool
) -> None:
    model = package.load("numpy", {"L": 0.7, "m": mass})
    (result,) = tied_impedance_calls("numpy", model, reference, package.module.Natural)
    assert result.held == passes


def test_an_impedance_that_is_nowhere_positive_is_left_out(
    package: Package, reference: LoopReference
) -> None:
    values = {**reference.values, "c2^": -reference.values["c2^"]}
    other = replace(reference, values=values)
    (result,) = tied_impedance_calls("numpy", package.load("numpy"), other, package.module.Natural)
    assert result.held is None


def test_another_length_is_open_where_loops_close(package: Package, reference: LoopReference) -> None:
    model = package.load("numpy", {"L": 0.7001, "m": 2.0})
    with pytest.raises(ValueError, match=r"^pin is open by 0\.\d+ mm at sample 0"):
        list(loop_calls("numpy", model, reference))


def test_a_length_with_which_loops_never_close_leaves_no_state_to_check(package: Package) -> None:
    tree = package.manifest.tree
    assert tree is not None
    too_long = tree_with(tree, package.manifest.formulas, {**package.manifest.parameters, "L": 9.0})
    assert loop_reference(package.manifest, too_long, random_states(package.manifest.joints, 60)) is None


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize(("mass", "passes"), [(2.0, True), (2.001, False)])
def test_another_mass_is_found_under_contacts_and_in_a_simulation(
    mass: float, passes: bool, tied: bool, reference: LoopReference, tmp_path: Path
) -> None:
    text = ROBOT if tied else ROBOT[: ROBOT.index("constraint = [")]
    (tmp_path / "robot.toml").write_text(text)
    system = read_system(tmp_path / "robot.toml", Options("symbolic"))
    write_package(generate(system, ["numpy"], kernel="loops"), tmp_path / "robot")
    package = load_package(tmp_path / "robot", Manifest.read(tmp_path / "robot"))
    manifest, model = package.manifest, package.load("numpy", {"L": 0.7, "m": mass} if tied else {"m": mass})
    assert manifest.tree is not None
    states = reference.states if tied else random_states(package.manifest.joints, 20)
    moved = simulated_motion(manifest, manifest.tree, states)
    assert [result.held for result in simulation_calls("numpy", model, moved)] == [passes]
    held = HeldContacts(manifest, manifest.tree, states).calls("numpy", model, package.module.Contact)
    assert [result.held for result in held] == ([] if tied else [passes]), "one freedom is left to the ties"


FLOATING = """schema = 1
name = "walker"
joint = [
  { name = "root", type = "floating", parent = "base", child = "trunk" },
  { name = "hip", parent = "trunk", child = "thigh", axis = [0, 1, 0], xyz = [0.05,0,-0.1] },
  { name = "knee", parent = "thigh", child = "shank", axis = [0, 1, 0], xyz = [0,0,-0.3] },
  { name = "hip2", parent = "trunk", child = "link2", axis = [0, 1, 0], xyz = [-0.05,0,-0.1] },
]
link = [
  {name = "trunk", mass = 4, com = [0, 0.01, 0.1], inertia = {xx = 0.05, yy = 0.06, zz = 0.04, xy = 0.003}},
  { name = "thigh", mass = 1, com = [0, 0, -0.15], inertia = { xx = 0.01, yy = 0.01, zz = 0.002 } },
  { name = "shank", mass = 0.5, com = [0.01, 0.01, -0.15], inertia = { xx = 0.005, yy = 0.005, zz = 0.001 } },
  { name = "link2", mass = 0.4, com = [0, 0, -0.15], inertia = { xx = 0.005, yy = 0.005, zz = 0.001 } },
]
[[constraint]]
name = "pin"
type = "point"
first = { frame = "shank", xyz = [-0.1, 0, 0.02] }
second = { frame = "link2", xyz = [0, 0, -0.3] }
"""
"""Arm whose first closed state is next to a base's pitch of 90 degrees."""


def test_states_next_to_a_singular_mass_matrix_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "walker.toml").write_text(FLOATING)
    write_package(generate(read_system(tmp_path / "walker.toml"), ["numpy"]), tmp_path / "walker")
    assert not [result for result in check_package(tmp_path / "walker", samples=5) if result.failed]


BODY = "inertia = {xx = 0.001, yy = 0.002, zz = 0.0025}"
SLIDER = f"""schema = 1
name = "right"
gravity = [0, 0, -9.81]
link = [
  {{name = "crank", mass = 1.0, com = [0.05, 0, 0], {BODY}}},
  {{name = "piston", mass = 0.5, {BODY}}},
]
joint = [
  {{name = "turn", parent = "base", child = "crank", axis = [0, 1, 0]}},
  {{name = "slide", type = "prismatic", parent = "base", child = "piston", axis = [1, 0, 0]}},
]
[[constraint]]
name = "rod"
type = "distance"
length = 0.3
first = {{frame = "crank", xyz = [0.1, 0, 0]}}
second = {{frame = "piston"}}
"""
CAM = f"""schema = 1
name = "right"
gravity = [0, 0, -9.81]
link = [
  {{name = "a", mass = 1.0, com = [0.1, 0, 0], inertia = {{xx = 0.01, yy = 0.01, zz = 0.01}}}},
  {{name = "b", mass = 0.3, com = [0.05, 0.02, 0], {BODY}}},
]
joint = [
  {{name = "ja", parent = "base", child = "a", axis = [0, 1, 0]}},
  {{name = "jb", type = "prismatic", parent = "a", child = "b", xyz = [0.2, 0, 0], axis = [1, 0, 1]}},
]
[[constraint]]
name = "cam"
type = "coupling"
terms = {{jb = 1, ja = [0.05, -0.1, 0.02, 0.003]}}
"""
LIGHT = """schema = 1
name = "right"
gravity = [0, 0, -9.81]
link = [
  {name = "b", mass = 10.0, com = [0.01, 0, 0.02], inertia = {xx = 1.0, yy = 1.2, zz = 0.9}},
  {name = "w", mass = 1e-4, com = [0, 0, 0.1], inertia = {xx = 1e-8, yy = 1e-8, zz = 1e-9}},
]
joint = [
  {name = "f", type = "floating", parent = "base", child = "b"},
  {name = "a", type = "ball", parent = "b", child = "w", xyz = [0.3, 0, 0]},
]
"""
FAR = (
    (Path(__file__).parents[1] / "data/fourbar.toml")
    .read_text()
    .replace('parent = "base", child = "crank"', 'parent = "base", child = "crank", xyz = [1000, 500, 0]')
    .replace('xyz = ["ground", 0, 0]', 'xyz = ["ground + 1000", 500, 0]')
)
DAMPED = f"""schema = 1
name = "right"
link = [
  {{name = "a", mass = 1.0, com = [0.1, 0, 0], {BODY}}},
  {{name = "b", mass = 0.3, com = [0.05, 0.02, 0], {BODY}}},
]
joint = [
  {{name = "ja", parent = "base", child = "a", damping = 0.7, friction = 0.4, armature = 0.05}},
  {{name = "jb", parent = "a", child = "b", xyz = [0.2, 0, 0], stiffness = 3, rest = 0.2, damping = 0.2}},
]
"""
PARALLEL = f"""schema = 1
name = "right"
link = [
  {{name = "a", mass = 1.0, com = [0.1, 0, 0], {BODY}}},
  {{name = "b", mass = 1.0, com = [0.1, 0, 0], {BODY}}},
]
joint = [
  {{name = "ja", parent = "base", child = "a"}},
  {{name = "jb", parent = "base", child = "b", xyz = [0.3, 0, 0]}},
]
[[constraint]]
name = "rod"
type = "distance"
first = {{frame = "a", xyz = [0.1, 0, 0]}}
second = {{frame = "b", xyz = [0.1, 0, 0]}}
length = 0.3
"""
ONE_POINT = f"""schema = 1
name = "right"
link = [{{name = "a", mass = 1.0, {BODY}}}]
joint = [{{name = "ja", type = "floating", parent = "base", child = "a"}}]
"""
COUPLING = """[[constraint]]
name = "curve"
type = "coupling"
terms = {ja = [0, 1, 0, -1], jb = [0, 0, 1]}
"""
MICRO = """schema = 1
name = "right"
link = [
  {name = "a", mass = 1e-6, com = [1e-6, 0, 2e-6], inertia = {xx = 2e-18, yy = 3e-18, zz = 2e-18}},
  {name = "b", mass = 1e-6, com = [2e-6, 1e-6, 0], inertia = {xx = 2e-18, yy = 3e-18, zz = 2e-18}},
]
joint = [
  {name = "f", type = "floating", parent = "base", child = "a"},
  {name = "ja", parent = "a", child = "b", xyz = [3e-6, 0, 0], axis = [0, 1, 0]},
]
"""
GEAR = f"""schema = 1
name = "right"
link = [
  {{name = "arm", mass = 3.0, com = [0.15, 0, 0], {BODY}}},
  {{name = "r", mass = 0.4, com = [0, 0, 0.01], inertia = {{xx = 4e-5, yy = 4e-5, zz = 6e-5}}}},
]
joint = [
  {{name = "j", parent = "base", child = "arm", axis = [0, 1, 0]}},
  {{name = "m", parent = "arm", child = "r", xyz = [0.3, 0, 0], mimic = {{joint = "j", multiplier = -160}}}},
]
"""
DUMBBELL = """schema = 1
name = "right"
link = [
  {name = "a", mass = 3, com = [0.1, 0.02, -0.03], inertia = {xx = 0.03, yy = 0.036, zz = 0.045}},
  {name = "b", mass = 0.01, com = [0.1, 0.02, -0.03], inertia = {xx = 1e-4, yy = 1.2e-4, zz = 1.5e-4}},
]
joint = [
  {name = "fa", type = "floating", parent = "base", child = "a"},
  {name = "fb", type = "floating", parent = "base", child = "b"},
]
[[constraint]]
name = "rod"
type = "distance"
first = {frame = "a", xyz = [0.1, 0.2, 0.3]}
second = {frame = "b", xyz = [0, 0.1, 0]}
length = 1.5
"""


def arm(size: float, *masses: float) -> str:
    """Links of this length, each turned against the one before, with these masses."""
    bodies, joints, parent = [], [], "base"
    for k, mass in enumerate(masses):
        x, y, z = (mass * size**2 * part for part in (1.0, 1.2, 1.5))
        own = f"com = [{0.4 * size}, 0, {size}], inertia = {{xx = {x}, yy = {y}, zz = {z}}}"
        place = f"xyz = [{size}, {0.3 * size}, 0], rpy = [1.2, 0.4, 0]"
        bodies.append(f'{{name = "l{k}", mass = {mass}, {own}}}')
        joints.append(f'{{name = "j{k}", parent = "{parent}", child = "l{k}", {place}}}')
        parent = f"l{k}"
    return f'schema = 1\nname = "right"\nlink = [{", ".join(bodies)}]\njoint = [{", ".join(joints)}]\n'


TWO_BARS = f"""schema = 1
name = "right"
link = [
  {{name = "a", mass = 1.0, com = [0.25, 0, 0], {BODY}}},
  {{name = "b", mass = 0.6, com = [0.25, 0, 0], {BODY}}},
]
joint = [
  {{name = "ja", parent = "base", child = "a", axis = [0, 0, 1]}},
  {{name = "jb", parent = "base", child = "b", xyz = [0.3, 0, 0], axis = [0, 0, 1]}},
]
[[constraint]]
name = "gap"
type = "distance"
first = {{frame = "a", xyz = [0.5, 0, 0]}}
second = {{frame = "b", xyz = [0.5, 0, 0]}}
"""
MICRO_GEARS = f"""schema = 1
name = "right"
link = [
  {{name = "a", mass = 1.0, com = [0.1, 0, 0], {BODY}}},
  {{name = "b", mass = 0.3, com = [0.05, 0.02, 0], {BODY}}},
]
joint = [
  {{name = "n", parent = "base", child = "a", axis = [0, 1, 0]}},
  {{name = "s", type = "prismatic", parent = "a", child = "b", axis = [1, 0, 0]}},
]
[[constraint]]
name = "g"
type = "coupling"
"""
RIGHT = {
    "tips of two bars that a rod of a millimetre ties, between dead points": (
        TWO_BARS + "length = 1e-3",
        "numpy",
        "auto",
    ),
    "the same of a tenth, which a motion leads to one": (TWO_BARS + "length = 1e-4", "numpy", "auto"),
    "a coupling that counts micrometres": (
        MICRO_GEARS + "terms = {s = [0, 1e6], n = [0, -1]}",
        "numpy",
        "auto",
    ),
    "one of large factors": (MICRO_GEARS + "terms = {s = [0, 1e9], n = [0, -5e9]}", "numpy", "auto"),
    "a rotor of 160 turns to one, whose angle is rounded by its size": (GEAR, "numpy", "auto"),
    "two floating bodies and a rod, of which one is light": (DUMBBELL, "numpy", "auto"),
    "an arm of ever lighter links": (
        arm(1.0, *(1e9 / 10.0**at for at in (0, 4, 9, 13, 18))),
        "numpy",
        "auto",
    ),
    "an arm of micrometres, which a hold at its end leaves nothing": (
        arm(1e-5, *[1e-12] * 6),
        "numpy",
        "auto",
    ),
    "a floating robot of micrometres, whose slides move it by more than turns": (MICRO, "numpy", "auto"),
    "two cranks and a rod, which at zero is across to how they move": (PARALLEL, "numpy", "auto"),
    "a body that floats about its centre of mass, all in one point": (ONE_POINT, "numpy", "auto"),
    "a slider-crank, one joint of which bears nothing by velocity": (SLIDER, "numpy", "auto"),
    "a cam that follows a polynomial": (CAM, "numpy", "auto"),
    "a light link on a body, whose contact leaves hardly any mass": (LIGHT, "numpy", "auto"),
    "a four-bar a kilometre away": (FAR, "numpy", "auto"),
    "joints that take torques of their own, in C": (DAMPED, "c", "auto"),
    "the same in loops": (DAMPED, "c", "loops"),
}


@pytest.mark.parametrize("robot", RIGHT)
def test_a_right_package_is_never_called_wrong(robot: str, tmp_path: Path) -> None:
    text, backend, kernel = RIGHT[robot]
    (tmp_path / "robot.toml").write_text(text)
    files = generate(read_system(tmp_path / "robot.toml"), [backend], kernel=kernel)
    write_package(files, tmp_path / "right")
    results = check_package(tmp_path / "right")
    assert not [result for result in results if result.failed]
    assert backend != "c" or "c: right_coefficients" in {result.name for result in results if result.held}


def test_where_one_joint_cannot_follow_another_nothing_is_asked(tmp_path: Path) -> None:
    """The coupling jb*jb = ja**3 - ja has jb stand still whatever ja does where jb is 0."""
    curve = PARALLEL.split("[[constraint]]")[0] + COUPLING
    (tmp_path / "robot.toml").write_text(curve)
    write_package(generate(read_system(tmp_path / "robot.toml"), ["numpy"]), tmp_path / "right")
    for samples in (1, 2, 8):
        results = check_package(tmp_path / "right", samples)
        assert not [result for result in results if result.failed]
        assert "numpy: velocities in closed loops against least squares" in {
            r.name for r in results if r.held
        }


def test_no_motion_is_asked_of_rods_that_agree_only_where_it_starts(tmp_path: Path) -> None:
    """Five rods on one regulus hold three freedoms; as soon as the platform moves, they hold five."""
    turns = np.arange(5) * 2 * np.pi / 5
    low = np.stack([0.2 * np.cos(turns), 0.2 * np.sin(turns), 0.1 + 0.0 * turns], -1)
    high = np.stack([0.5 * np.cos(turns + 0.3), 0.5 * np.sin(turns + 0.3), 2.0 + 0.0 * turns], -1)
    rods = [
        f"""[[constraint]]
        name = "rod{k}"
        type = "distance"
        length = 1.9
        first = {{frame = "a", xyz = {low[k].tolist()}}}
        second = {{frame = "base", xyz = {high[k].tolist()}}}
        """
        for k in range(5)
    ]
    (tmp_path / "hung.toml").write_text(ONE_POINT + "\n".join(rods))
    write_package(generate(read_system(tmp_path / "hung.toml"), ["numpy"]), tmp_path / "hung")
    found = {result.name: result for result in check_package(tmp_path / "hung")}
    assert not [result for result in found.values() if result.failed]
    assert found["numpy: a simulated motion"].detail.startswith("what holds a loop twice does not agree")
    assert found["numpy: shares in closed loops against least squares"].held


def test_ties_that_agree_no_more_where_they_are_closed_leave_no_motion_to_compare(
    package: Package, reference: LoopReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ties are looked at first, and again once each state has been closed."""
    first = iter([True])

    def agree(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
        return np.full(len(rows), next(first, False))

    monkeypatch.setattr(simulation_checks, "_agree", agree)
    assert package.manifest.tree is not None
    moved = simulated_motion(package.manifest, package.manifest.tree, reference.states)
    (result,) = simulation_calls("numpy", package.load("numpy"), moved)
    assert (result.mark, result.detail) == ("skip", simulation_checks.HELD_TWICE)


@pytest.mark.parametrize(("size", "most"), [(1.0, 0.3), (1e-3, 0.006)])
def test_contacts_are_as_near_as_links_are_short(size: float, most: float, tmp_path: Path) -> None:
    """One arm is of 0.3 m, and one of 0.3 mm."""
    text = f"""schema = 1
    name = "arm"
    link = [{{name = "a", mass = {size**3}, inertia = {{xx = {size**5}, yy = {size**5}, zz = {size**5}}}}}]
    joint = [{{name = "j", parent = "base", child = "a", xyz = [{0.3 * size}, 0, 0]}}]
    """
    (tmp_path / "arm.toml").write_text(text)
    write_package(generate(read_system(tmp_path / "arm.toml"), ["numpy"]), tmp_path / "arm")
    manifest = Manifest.read(tmp_path / "arm")
    assert manifest.tree is not None
    held = HeldContacts(manifest, manifest.tree, random_states(manifest.joints, 2))
    assert 0.0 < np.linalg.norm(held.equations("point", manifest.tree).arguments["point"]) < most
