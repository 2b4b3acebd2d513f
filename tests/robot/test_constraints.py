"""Constraints as files have them: TOML's, those beside a file of any format, and MJCF's equalities."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers import urdf_text
from helpers.answers import relative_error
from linkwise import LinkwiseError, Options, generate, read_robot, read_system, write_package
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.load import import_package
from linkwise.robot import effects
from linkwise.robot.robot import Robot
from linkwise.symbolic.system import RigidSystem

FOURBAR = DATA / "fourbar.toml"


def robot_of(path: Path, **options: Any) -> Robot:
    system = read_system(path, Options(**options))
    assert isinstance(system, RigidSystem)
    return system.robot


def loaded(path: Path, folder: Path, **options: Any) -> Any:
    """NumPy's face of the package."""
    directory = folder / f"package_{path.stem}"
    write_package(generate(read_system(path, Options(**options)), ["numpy"]), directory)
    return import_package(directory).load("numpy")


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(
    ("robot", "free", "following"),
    [
        ("fourbar", ("a",), ("b", "c")),
        ("fivebar", ("left", "right"), ("elbow_left", "elbow_right")),
        ("delta", ("arm1", "arm2", "arm3"), ("x", "y", "z")),
    ],
)
def test_joints_near_the_ground_move_the_others(
    robot: str, free: tuple[str, ...], following: tuple[str, ...], tmp_path: Path
) -> None:
    constraints = loaded(DATA / f"{robot}.toml", tmp_path).constraints
    assert constraints.independent == free
    assert constraints.dependent == following
    q = np.random.default_rng(1).uniform(-0.2, 0.2, (20, len(free) + len(following)))
    assert np.abs(constraints.violation(constraints.closed(q))).max() < 1e-9


def test_joints_that_are_asked_for_are_independent(tmp_path: Path) -> None:
    assert robot_of(DATA / "delta.toml", independent=("z", "x", "y")).independent == (3, 4, 5)
    files = generate(read_robot(FOURBAR), ["numpy"])
    assert json.loads(files["manifest.json"])["tree"]["independent"] == [0]
    own = written(tmp_path, "own.toml", 'independent = ["c"]\n' + FOURBAR.read_text())
    assert robot_of(own).independent == (2,)
    assert robot_of(own, independent=("b",)).independent == (1,)


PLANAR = """<mujoco model="fourbar"><compiler angle="radian"/><option gravity="0 -9.81 0"/>
<worldbody>
  <body name="crank"><joint name="a"/>
    <inertial pos="0.06 0.01 0" mass="0.4" diaginertia="0.0001 0.0005 0.0006"/>
    <body name="rod" pos="0.12 0 0"><joint name="b"/>
      <inertial pos="0.155 0 0.02" mass="0.9" diaginertia="0.0002 0.007 0.0071"/>
      <site name="pin_first" pos="0.31 0 0"/></body></body>
  <body name="rocker" pos="0.28 0 0"><joint name="c"/>
    <inertial pos="0.12 -0.01 0" mass="0.7" diaginertia="0.0002 0.004 0.0041"/>
    <site name="pin_second" pos="0.24 0 0"/></body>
</worldbody>
<equality><connect name="pin" site1="pin_first" site2="pin_second"/></equality>{more}</mujoco>"""


def planar_link(name: str, mass: float, com: str, inertia: tuple[float, float, float]) -> str:
    moments = " ".join(
        f'{axis}="{value}"' for axis, value in zip(("ixx", "iyy", "izz"), inertia, strict=True)
    )
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def planar_urdf(more: str = "") -> str:
    return urdf_text.robot(
        '<link name="base"/>',
        planar_link("crank", 0.4, "0.06 0.01 0", (0.0001, 0.0005, 0.0006)),
        planar_link("rod", 0.9, "0.155 0 0.02", (0.0002, 0.007, 0.0071)),
        planar_link("rocker", 0.7, "0.12 -0.01 0", (0.0002, 0.004, 0.0041)),
        '<joint name="a" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 0 1"/>'
        "</joint>",
        '<joint name="b" type="continuous"><parent link="crank"/><child link="rod"/><origin xyz="0.12 0 0"/>'
        '<axis xyz="0 0 1"/></joint>',
        '<joint name="c" type="continuous"><parent link="base"/><child link="rocker"/>'
        '<origin xyz="0.28 0 0"/><axis xyz="0 0 1"/></joint>',
        more,
    )


LOOP = """schema = 1
        parameters = { rod = 0.31 }
        [[constraint]]
        name = "pin"
        type = "point"
        first = { frame = "rod", xyz = ["rod", 0, 0] }
        second = { frame = "rocker", xyz = [0.24, 0, 0] }"""


def test_one_mechanism_answers_alike_in_every_format(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    beside = str(written(tmp_path, "loop.toml", LOOP))
    robots = [
        loaded(FOURBAR, tmp_path),
        loaded(written(tmp_path, "bar.urdf", planar_urdf()), tmp_path, constraints=beside),
        loaded(written(tmp_path, "same.xml", PLANAR.format(more="")), tmp_path),
    ]
    own = robots[0].constraints
    q = own.closed(np.random.default_rng(0).uniform(-0.3, 0.3, (10, 3)))
    qd, qdd = np.random.default_rng(1).uniform(-2, 2, (2, 10, 3))
    for other in (robot.constraints for robot in robots[1:]):
        assert (other.rows, other.independent, other.redundant) == (own.rows, own.independent, own.redundant)
        assert relative_error(other.jacobian(q), own.jacobian(q)) < 1e-12
        assert relative_error(other.violation(q + 0.1), own.violation(q + 0.1)) < 1e-12
        for mine, its in zip(own.coefficients(q, qd)[:2], other.coefficients(q, qd)[:2], strict=True):
            assert relative_error(its, mine) < 1e-11
    by_mjcf = robots[2].constraints.partial_torque(q, qd, qdd)  # URDF has no gravity of its own
    assert relative_error(by_mjcf, own.partial_torque(q, qd, qdd)) < 1e-11


def test_joints_with_motors_then_with_springs_are_rather_independent(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    motor = '<actuator><motor joint="c"/></actuator>'
    sprung = PLANAR.replace('name="b"/>', 'name="b" stiffness="2"/>')
    cord = '<tendon><fixed name="cord"><joint joint="c" coef="2"/></fixed></tendon>'
    for how in (
        motor,
        motor.replace("joint=", "jointinparent="),
        cord + motor.replace('joint="c"', 'tendon="cord"'),
    ):
        assert robot_of(written(tmp_path, "driven.xml", PLANAR.format(more=how))).independent == (2,)
    assert robot_of(written(tmp_path, "sprung.xml", sprung.format(more=""))).independent == (1,)
    assert robot_of(written(tmp_path, "both.xml", sprung.format(more=motor))).independent == (2,)


def test_a_sum_with_a_slope_is_taken_whatever_the_sizes_of_its_terms(tmp_path: Path) -> None:
    arm = urdf_text.chain(urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c"))
    beside = written(tmp_path, "sum.toml", COUPLED + "terms = { ab = [0, 0, 1e9], bc = 1 }")
    assert robot_of(written(tmp_path, "arm.urdf", arm), constraints=str(beside)).independent == (1,)


def test_of_joints_with_motors_one_that_follows_another_is_rather_dependent(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    text = """<mujoco><option gravity="0 0 0"/><worldbody>
      <body><joint name="near" axis="0 1 0"/><geom size="0.1" mass="1"/>
        <body pos="0.3 0 0"><joint name="far" axis="0 1 0"/><geom size="0.1" mass="1"/></body></body>
      </worldbody><actuator><motor joint="near"/><motor joint="far"/></actuator>
      <equality><joint joint1="{follower}" joint2="{other}"/></equality></mujoco>"""
    for follower, other, free in (("near", "far", 1), ("far", "near", 0)):
        path = written(tmp_path, f"{follower}.xml", text.format(follower=follower, other=other))
        assert robot_of(path).independent == (free,)


def test_joints_that_urdf_files_have_actuators_on_are_rather_independent(tmp_path: Path) -> None:
    beside = str(written(tmp_path, "loop.toml", LOOP))
    commanded = '<ros2_control><joint name="c"><command_interface name="effort"/></joint></ros2_control>'
    seen = commanded.replace("command_interface", "state_interface")
    geared = '<transmission name="t"><joint name="c"/><actuator name="m"/></transmission>'
    for more, own in (("", (0,)), (seen, (0,)), (commanded, (2,)), (geared, (2,))):
        path = written(tmp_path, "bar.urdf", planar_urdf(more))
        assert robot_of(path, constraints=beside).independent == own, more


ARMS = """<mujoco model="arms"><compiler angle="radian"/><option jacobian="dense"/><worldbody>
  <body name="left" pos="0.1 0 0.2" euler="0.3 0 0.1">
    <joint name="l1" axis="0 1 0" ref="0.3"/><joint name="l2" axis="1 0 0.2" pos="0.02 0 0.1"/>
    <geom size="0.1" mass="1"/>
    <body name="wrist" pos="0.3 0.05 0" euler="0 0.4 0">
      <joint name="l3" axis="0 0 1"/><joint name="l4" type="slide" axis="1 1 0" ref="-0.1"/>
      <geom size="0.1" mass="1"/><site name="grip" pos="0.1 0.02 0.03" euler="0.2 0.5 -0.1"/></body></body>
  <body name="right" pos="0 0.4 0.2">
    <joint name="r1" axis="0 1 0"/><geom size="0.1" mass="1"/>
    <body name="hand" pos="0.2 0 0.1" quat="0.9 0.1 -0.2 0.3">
      <joint name="r2" axis="1 0 0"/><joint name="r3" axis="0 1 0"/><joint name="r4" axis="0 0 1"/>
      <geom size="0.1" mass="1"/>
      <site name="palm" pos="-0.05 0.1 0" euler="0.1 0 0.7"/></body></body>
</worldbody>
<tendon><fixed name="cord"><joint joint="l1" coef="1.5"/><joint joint="r1" coef="-0.5"/></fixed>
  <fixed name="cable"><joint joint="l3" coef="0.7"/><joint joint="r2" coef="2"/></fixed></tendon>
<equality>{equality}</equality></mujoco>"""

EQUALITIES = {
    "connect": '<connect body1="wrist" body2="hand" anchor="0.1 0.2 -0.1"/>',
    "connect to the world": '<connect body1="hand" anchor="0.1 0 0"/>',
    "connect of sites": '<connect site1="palm" site2="grip"/>',
    "weld": '<weld body1="wrist" body2="hand" torquescale="0.7"/>',
    "weld elsewhere": '<weld body1="wrist" body2="hand" relpose="0.2 0.1 0.1 5 5 -3 2" anchor="0.1 0 0"/>',
    "weld of sites": '<weld site1="grip" site2="palm"/>',
    "weld that turns": '<weld body1="wrist" body2="hand" torquescale="0"/>',
    "joint": '<joint joint1="l1" joint2="r1" polycoef="0.1 0.5 -0.3 0.2 0.1"/>',
    "joint with a slide": '<joint joint1="l4" joint2="l1" polycoef="0.02 0.5 1 0 0"/>',
    "held joint": '<joint joint1="l4" polycoef="0.1 0 0 0 0"/>',
    "tendons": '<tendon tendon1="cord" tendon2="cable" polycoef="0.1 0.8 0 0 0"/>',
    "tendon": '<tendon tendon1="cable" polycoef="0.2 0 0 0 0"/>',
}


@pytest.mark.parametrize("equality", EQUALITIES)
def test_equality_of_mjcf_is_mujocos_own(equality: str, tmp_path: Path) -> None:
    """The equality holds at any position, but for turns, which MuJoCo counts otherwise: these are alike where
    they close."""
    mujoco = pytest.importorskip("mujoco")
    path = written(tmp_path, "arms.xml", ARMS.format(equality=EQUALITIES[equality]))
    constraints = loaded(path, tmp_path).constraints
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    positions = np.random.default_rng(0).uniform(-1.0, 1.0, (20, model.nq))
    turns = [at for at, row in enumerate(constraints.rows) if "moment" in row]
    shifts = [at for at in range(len(constraints.rows)) if at not in turns]
    for q in (*positions, *(constraints.closed(0.2 * positions) if turns else ())):
        data.qpos = q
        mujoco.mj_forward(model, data)
        its = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        phi, rows = data.efc_pos[its], data.efc_J.reshape(-1, model.nv)[its]
        own = constraints.violation(q), constraints.jacobian(q)
        assert np.abs(own[0][shifts] - phi[: len(shifts)]).max() < 1e-12
        assert np.abs(own[1][shifts] - rows[: len(shifts)]).max() < 1e-12
        if turns:
            scale = float(model.eq_data[0][10])
            twice = 2 * np.linalg.norm(phi[len(shifts) :]) / scale
            assert np.linalg.norm(own[0][turns]) == pytest.approx(twice, abs=1e-9)
    if turns:  # the last position is a closed one, where both take the same motions away
        singular = np.linalg.svd(np.vstack([rows, own[1]]))[1]
        assert np.linalg.matrix_rank(rows) == len(rows) == int((singular > 1e-9).sum())


def test_ends_in_a_file_beside_stand_in_the_sites_of_an_mjcf_file(tmp_path: Path) -> None:
    mujoco, rotations = pytest.importorskip("mujoco"), pytest.importorskip("scipy.spatial.transform")
    path = written(tmp_path, "arms.xml", ARMS.format(equality=""))
    ends = {"grip": ([0.1, 0.2, -0.3], [0.4, -0.5, 0.6]), "palm": ([-0.2, 0.0, 0.1], [0.2, 0.1, -0.3])}
    told = [f'{{ frame = "{site}", xyz = {xyz}, rpy = {rpy} }}' for site, (xyz, rpy) in ends.items()]
    text = (
        f'schema = 1\n[[constraint]]\nname = "weld"\ntype = "frame"\nfirst = {told[0]}\nsecond = {told[1]}\n'
    )
    beside = str(written(tmp_path, "weld.toml", text))
    constraints = loaded(path, tmp_path, constraints=beside).constraints
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for q in np.random.default_rng(0).uniform(-1.0, 1.0, (5, model.nq)):
        data.qpos = q
        mujoco.mj_forward(model, data)
        places, turns = [], []
        for site, (xyz, rpy) in ends.items():
            turn = data.site(site).xmat.reshape(3, 3)
            places.append(data.site(site).xpos + turn @ xyz)
            turns.append(rotations.Rotation.from_matrix(turn) * rotations.Rotation.from_euler("xyz", rpy))
        found, apart = constraints.violation(q), (turns[0] * turns[1].inv()).magnitude()
        np.testing.assert_allclose(found[3:], places[0] - places[1], atol=1e-12)
        assert np.linalg.norm(found[:3]) == pytest.approx(2.0 * np.sin(apart / 2.0), abs=1e-12)


BAR = """schema = 1
independent = {independent}
{constraint}"""
POINT = """[[constraint]]
name = "{name}"
type = "{type}"
{first}
second = {{ frame = "rocker", xyz = [0.24, 0, 0] }}
{more}"""


def beside(folder: Path, **changed: str) -> str:
    """A file of one constraint, as it is not to be written."""
    usual = {"name": "own", "type": "point", "first": 'first = { frame = "crank" }', "more": ""}
    found = {key: changed.get(key, value) for key, value in usual.items()}
    text = BAR.format(independent=changed.get("independent", "[]"), constraint=POINT.format(**found))
    return str(written(folder, "beside.toml", changed.get("text", text)))


COUPLED = 'schema = 1\n[[constraint]]\nname = "own"\ntype = "coupling"\n'
CENTRES = 'first = { frame = "base" }\nsecond = { frame = "crank" }\nlength = 0.2'
BAD: dict[str, tuple[dict[str, str], str]] = {
    "unknown link": (
        {"first": 'first = "crunk"'},
        "constraint 'own' ties 'crunk', which is not a link or a site; correct it",
    ),
    "no end": ({"first": ""}, "constraint 'own' needs 'first', a link's name or {frame = NAME, xyz = […]}"),
    "unknown type": (
        {"type": "weld"},
        "constraint 'own' has the type 'weld'; the types are point, hinge, frame, distance, coupling",
    ),
    "name of another": ({"name": "pin"}, "2 constraints are named 'pin'; rename all but one"),
    "no name": ({"name": " "}, "a constraint has an empty name; name it"),
    "unknown key": (
        {"more": "axis = 3"},
        "constraint 'own' has the unknown key 'axis'; known are first, name",
    ),
    "axis of a point": (
        {"first": 'first = { frame = "crank", axis = [0, 0, 1] }'},
        "constraint 'own', first has the unknown key 'axis'",
    ),
    "zero axis": (
        {"type": "hinge", "first": 'first = { frame = "crank", axis = [0, 0, 0] }'},
        "constraint 'own', first has a zero axis; give its direction, such as [0, 0, 1]",
    ),
    "no length": ({"type": "distance"}, "constraint 'own' needs 'length', in m"),
    "zero length": (
        {"type": "distance", "more": "length = 0"},
        "constraint 'own' has the length 0; give one above 0, or the type point",
    ),
    "nan": (
        {"first": 'first = { frame = "crank", xyz = [nan, 0, 0] }'},
        "constraint 'own' has NaN or infinity in its place; give numbers",
    ),
    "never closes": (
        {"first": 'first = { frame = "base", xyz = [2, 0, 0] }'},
        "constraint 'own' never closes: from 24 positions that were tried, ",
    ),
    "ends that always coincide": (
        {"text": 'schema = 1\n[[constraint]]\nname = "own"\ntype = "distance"\n' + CENTRES},
        "constraint 'own' never closes: from 24 positions that were tried, 200 mm are left at best",
    ),
    "nothing moves": (
        {"first": 'first = { frame = "base", xyz = [0.28, 0.24, 0] }'},
        "the constraints 'pin', 'own' leave nothing to move, so the robot stands still; remove one, or",
    ),
    "unknown joint": (
        {"text": COUPLED + "terms = { a = 1, elbow = 2 }"},
        "constraint 'own' couples 'elbow', which is not a joint that moves; correct it",
    ),
    "no terms": ({"text": COUPLED}, "constraint 'own' needs 'terms', {JOINT = FACTOR, "),
    "constant term": (
        {"text": COUPLED + "terms = { a = 1, b = [2, 0] }"},
        "constraint 'own': 'b' in 'terms' is the same for every position; give a factor that is not 0",
    ),
    "nan of a term": (
        {"text": COUPLED + "terms = { a = nan, b = 1 }"},
        "constraint 'own' has NaN or infinity in its terms; give numbers",
    ),
    "square": (
        {"text": COUPLED + "terms = { a = [0, 0, 1] }"},
        "constraint 'own' closes only where it is singular: no motion of its joints changes",
    ),
    "sum without a zero": (
        {"text": COUPLED + "terms = { a = [0.5, 0, 1], b = [0, 0, 1] }"},
        " of its sum, in rad and m are left at best",
    ),
    "high power": (
        {"text": COUPLED + f"terms = {{ a = {[1] * 10} }}"},
        "constraint 'own': 'a' in 'terms' has the power 9; 8 is the highest",
    ),
    "words": (
        {"text": COUPLED + 'terms = { a = "b" }'},
        "'a' in 'terms' must be a factor, or a list of numbers",
    ),
    "parameter of the robot": (
        {"text": "schema = 1\nparameters = { rod = 2 }"},
        "parameter 'rod' is one of the robot's file already; rename it",
    ),
    "unknown joint asked for": (
        {"text": 'schema = 1\nindependent = ["d"]'},
        "independent has 'd', which is not a moving joint; the joints are a, b, c",
    ),
    "too many asked for": (
        {"text": 'schema = 1\nindependent = ["b", "c"]'},
        "2 joints are given as independent, and the constraints leave 1 to choose; choose --independent a",
    ),
    "twice asked for": (
        {"text": 'schema = 1\nindependent = ["b", "b"]'},
        "the independent joint 'b' is given 2 times; give it once",
    ),
    "itself": (
        {"first": 'first = { frame = "rocker", xyz = [0.1, 0, 0] }'},
        "constraint 'own' ties link 'rocker' to itself; name two links",
    ),
    "no schema": ({"text": ""}, "the schema is None; write schema = 1 at the top"),
    "robot": ({"text": FOURBAR.read_text()}, "the file has the unknown key 'name'"),
}


@pytest.mark.parametrize("case", ["unknown link", "unknown joint", "name of another", "nan", "no length"])
def test_the_file_beside_is_named_for_what_is_wrong_in_it(case: str, tmp_path: Path) -> None:
    file = beside(tmp_path, **BAD[case][0])
    with pytest.raises(LinkwiseError) as caught:
        robot_of(FOURBAR, constraints=file)
    assert str(caught.value).startswith(f"{FOURBAR}: {file}: ")


def test_joints_whose_names_have_commas_can_be_independent(tmp_path: Path) -> None:
    comma = written(tmp_path, "comma.toml", FOURBAR.read_text().replace('name = "a"', 'name = "a,1"'))
    assert robot_of(comma, independent=("a,1",)).independent == (0,)
    with pytest.raises(
        LinkwiseError, match=r"^.*--independent '' is not a moving joint; the joints are a,1, b, c$"
    ):
        robot_of(comma, independent=("b,",))


def test_a_distance_may_be_a_formula_of_numbers(tmp_path: Path) -> None:
    bar = 'schema = 1\nparameters = { L = 0.1 }\n[[constraint]]\nname = "own"\ntype = "distance"\n'
    bar += 'first = { frame = "rod", xyz = [0.31, 0, 0] }\nsecond = { frame = "rocker" }\n'
    bar += 'length = "2*L + 0.04"\n'
    tree = written(tmp_path, "tree.toml", FOURBAR.read_text().partition("[[constraint]]")[0])
    file = str(written(tmp_path, "bar.toml", bar))
    assert robot_of(tree, constraints=file).ties[0].length == pytest.approx(0.24)
    with pytest.raises(
        LinkwiseError, match=r"'own' has the length .*L.*, which stays a number in generated code"
    ):
        robot_of(tree, constraints=file, parameters="symbolic")


@pytest.mark.parametrize("case", BAD)
def test_constraint_that_cannot_be_is_named(case: str, tmp_path: Path) -> None:
    changed, message = BAD[case]
    with pytest.raises(LinkwiseError) as caught:
        robot_of(FOURBAR, constraints=beside(tmp_path, **changed))
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(FOURBAR))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "pin",
    [
        'type = "point"\nfirst = {{ frame = "rod", xyz = [0.3, 0, {n}] }}\nsecond = {{ frame = "rocker" }}',
        'type = "coupling"\nterms = {{ a = 1, b = [0, -2] }}',
    ],
    ids=["ties", "couplings"],
)
def test_far_more_constraints_than_could_hold_anything_are_refused_at_once(pin: str, tmp_path: Path) -> None:
    """Finding which of them follow from others takes time and memory by the square of their number."""
    tree = FOURBAR.read_text().partition("[[constraint]]")[0]

    def refused(count: int) -> str:
        pins = "".join(f'[[constraint]]\nname = "p{n}"\n{pin.format(n=n)}\n' for n in range(count))
        try:
            robot_of(written(tmp_path, "pins.toml", tree + pins))
        except LinkwiseError as error:
            return str(error)
        return ""

    limits = ProcessLimits(seconds=8, memory=1 << 28)
    told = "joints that move are 3, and constraints 3,000, of which 30 are the most, as each is to hold what"
    assert told in in_own_process(lambda: refused(3_000), limits)
    assert "30 are the most" in refused(31)
    assert "are the most" not in refused(30)


def test_joints_that_others_do_not_follow_cannot_be_independent(tmp_path: Path) -> None:
    tree = FOURBAR.read_text().partition("[[constraint]]")[0]
    geared = tree + COUPLED.removeprefix("schema = 1\n") + "terms = { b = 1, c = -2 }\n"
    told = (
        "b, c cannot be independent, for the other joints do not follow from them; choose --independent a,c"
    )
    with pytest.raises(LinkwiseError, match=told):
        robot_of(written(tmp_path, "geared.toml", geared), independent=("b", "c"))
    with pytest.raises(LinkwiseError, match="--independent is for constraints, and here are none; leave it"):
        robot_of(written(tmp_path, "tree.toml", tree), independent=("b",))


def test_a_file_without_constraints_for_a_robot_without_is_refused(tmp_path: Path) -> None:
    tree = written(tmp_path, "tree.toml", FOURBAR.read_text().partition("[[constraint]]")[0])
    lone = written(tmp_path, "lone.toml", 'schema = 1\nindependent = ["b"]\n')
    with pytest.raises(LinkwiseError, match=r"lone.toml: there is no \[\[constraint\]\] in it, nor any in"):
        robot_of(tree, constraints=str(lone))


def notes_of(robot: Robot) -> set[tuple[str, str, str]]:
    return {(note.kind, note.subject, note.detail) for note in robot.notes}


def test_ends_that_are_held_or_cut_away_are_told(tmp_path: Path) -> None:
    """One of the five-bar's arms is locked, cut away, or both stand still where they do not meet."""
    path = DATA / "fivebar.toml"
    held = robot_of(path, lock={"left": 1.0})
    assert [tie.name for tie in held.ties] == ["tip"]
    assert [held.coordinates[k].name for k in held.independent] == ["elbow_left"]
    with pytest.raises(LinkwiseError) as caught:
        robot_of(path, tip="fore_left")
    assert str(caught.value) == (
        f"{path}: constraint 'tip' ties link 'fore_left' to link 'fore_right', which --root or --tip cuts "
        "away; keep both, or remove the constraint from the file"
    )
    gone = robot_of(path, tip="upper_left")
    assert not gone.ties
    assert ("cut", "tip", "a constraint on links that are not there") in notes_of(gone)
    wheel = "link = [ { name = 'wheel', mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },"
    spare = path.read_text().replace("link = [", wheel)
    spare = spare.replace("joint = [", "joint = [ { name = 'spin', parent = 'base', child = 'wheel' },")
    arms = ("left", "elbow_left", "right", "elbow_right")
    still = robot_of(written(tmp_path, "spare.toml", spare), lock=dict.fromkeys(arms, 0.0))
    assert not still.ties
    assert ("ignored", "tip", "its ends move as one, 170 mm away from it") in notes_of(still)
    assert any(text.startswith("constraints left out of the torques: tip") for text in effects(still.notes))


def test_couplings_pass_through_locks_and_mimic_joints(tmp_path: Path) -> None:
    """The coupling 1 + a + 3 b^2 + d is 1.27 + 4.6 a + 12 a^2 + d with b = 2 a + 0.3 put in."""
    path = written(
        tmp_path,
        "hand.toml",
        """schema = 1
name = "hand"
joint = [
  { name = "a", parent = "base", child = "p" },
  { name = "b", parent = "p", child = "q", mimic = { joint = "a", multiplier = 2, offset = 0.3 } },
  { name = "c", type = "prismatic", parent = "base", child = "r" },
  { name = "d", parent = "r", child = "s" },
]
link = [
  { name = "p", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },
  { name = "q", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },
  { name = "r", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },
  { name = "s", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },
]
[[constraint]]
name = "gear"
type = "coupling"
terms = { d = 1, a = [1, 1], b = [0, 0, 3] }
[[constraint]]
name = "rack"
type = "coupling"
terms = { c = 10, d = -1 }
""",
    )
    terms = {coupling.name: dict(coupling.terms) for coupling in robot_of(path).couplings}
    assert terms["gear"] == {0: pytest.approx((1.27, 4.6, 12.0)), 2: (0.0, 1.0)}
    assert terms["rack"] == {1: (0.0, 10.0), 2: (0.0, -1.0)}
    locked = robot_of(path, lock={"d": -1.6})
    assert {coupling.name: dict(coupling.terms) for coupling in locked.couplings} == {
        "rack": {1: (1.6, 10.0)}
    }
    assert ("freed", "d", "locked, though coupled to 'a' and 'b' by constraint 'gear'") in notes_of(locked)
    twice = COUPLED + "terms = { b = 1, a = -2 }"
    with pytest.raises(LinkwiseError) as caught:
        robot_of(path, constraints=str(written(tmp_path, "twice.toml", twice)))
    assert "constraint 'own' cannot hold: the joints that it couples stand still or " in str(caught.value)
    assert "move as one, and miss it by 0.3; correct it" in str(caught.value)
    with pytest.raises(LinkwiseError) as caught:
        robot_of(path, root="base", tip="s")
    assert "joint 'd' is coupled to 'a' by constraint 'gear', which is not a moving joint here" in str(
        caught.value
    )
    freed = robot_of(path, root="base", tip="s", free_mimic=True)
    assert [coupling.name for coupling in freed.couplings] == ["rack"]
    assert ("freed", "d", "coupled to 'a' and 'b' by constraint 'gear'") in notes_of(freed)


def test_a_files_own_parameters_move_places_of_constraints() -> None:
    robot = robot_of(FOURBAR, parameters="symbolic")
    ends = {frame.name: str(frame.translation[0]) for frame in robot.frames if frame.name.startswith("pin")}
    assert ends == {"pin_first": "rod", "pin_second": "rocker"}


def test_a_base_that_floats_carries_its_loop_along(tmp_path: Path) -> None:
    floating = robot_of(FOURBAR, base="floating", allow_unphysical=True)
    assert [floating.coordinates[k].name for k in floating.independent][-1] == "a"
    assert len(floating.independent) == 7


def test_a_joint_that_carries_a_whole_loop_moves_none_of_it(tmp_path: Path) -> None:
    """Columns of A that are rounding alone say nothing about what the loop allows."""
    turned = "rpy = [0.3, 0.7, 0], axis = [1, 0, 0.2]"
    turret = f"joint = [ {{ name = 't', parent = 'base', child = 'turret', {turned} }},"
    carried = (
        FOURBAR.read_text().replace("joint = [", turret).replace("link = [", "link = [ { name = 'turret' },")
    )
    for joint in ("a", "c"):
        carried = carried.replace(f'"{joint}", parent = "base"', f'"{joint}", parent = "turret"')
    constraints = loaded(written(tmp_path, "turret.toml", carried), tmp_path).constraints
    assert constraints.independent == ("t", "a")
    q = constraints.closed(np.random.default_rng(0).uniform(-1.0, 1.0, (50, 4)))
    assert np.abs(constraints.velocity_map(q)[:, 2:, 0]).max() < 1e-12


def test_ends_are_placed_as_joints_are(tmp_path: Path) -> None:
    """A hinge where a joint is lets it turn, and nothing else; beside it, it holds nothing."""
    place = "xyz = ['2*L', 0.1, -0.3], rpy = [0.3, 'pi/3', -1]"
    axis = "axis = [1, 2, -2]"
    robot = f"""schema = 1
name = "arm"
parameters = {{ L = 0.2 }}
joint = [
  {{ name = "j", parent = "base", child = "p", {place}, {axis} }},
  {{ name = "k", parent = "p", child = "q", xyz = [0, 0.2, 0], axis = [0, 1, 0] }},
]
link = [
  {{ name = "p", mass = 1, inertia = {{ xx = 1, yy = 1, zz = 1 }} }},
  {{ name = "q", mass = 1, inertia = {{ xx = 1, yy = 1, zz = 1 }} }},
]
[[constraint]]
name = "again"
type = "hinge"
first = {{ frame = "base", {place}, {axis} }}
second = {{ frame = "p", {axis} }}
"""
    with pytest.raises(LinkwiseError, match="the constraints 'again' hold however the joints move"):
        robot_of(written(tmp_path, "again.toml", robot))
    geared = robot + COUPLED.removeprefix("schema = 1\n") + "terms = { j = 2, k = -1 }\n"
    constraints = loaded(
        written(tmp_path, "geared.toml", geared), tmp_path, parameters="symbolic"
    ).constraints
    violation = constraints.violation(np.random.default_rng(0).uniform(-3, 3, (20, 2)))
    assert np.abs(violation[:, :5]).max() < 1e-14
    assert np.abs(violation[:, 5]).min() > 1e-3
    assert constraints.redundant == ("again",)


def test_a_loop_is_planar_within_the_digits_of_its_file(tmp_path: Path) -> None:
    upright = FOURBAR.read_text().replace("gravity = [0, -9.81, 0]", "gravity = [0, 0, -9.81]")
    for joint, roll in (("a", "1.570796"), ("c", "1.5707963")):
        upright = upright.replace(f'name = "{joint}",', f'name = "{joint}", rpy = [{roll}, 0, 0],')
    constraints = loaded(written(tmp_path, "upright.toml", upright), tmp_path).constraints
    assert (constraints.independent, constraints.redundant) == (("a",), ())
    q = constraints.closed(np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3)))
    assert constraints.velocity_map(q).shape == (20, 3, 1)
