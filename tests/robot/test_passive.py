"""Springs, damping, friction and rotors of joints, from every kind of file."""

from pathlib import Path

import pytest
from helpers.urdf_text import joint, link, mimic, robot
from linkwise import LinkwiseError, Options, read_robot
from linkwise_runtime.structure import PassiveJoint

HINGE = '<dynamics damping="0.5" friction="0.2"/>'
SPRING = """<gazebo reference="ab"><springStiffness>3</springStiffness><springReference>0.4</springReference>
</gazebo>"""
ROTOR = """<transmission xmlns:drake="http://drake.mit.edu"><joint name="bc"/>
<actuator><drake:rotor_inertia value="2e-4"/><drake:gear_ratio value="50"/></actuator></transmission>"""


def read(path: Path, text: str, **options: object) -> tuple[PassiveJoint, ...]:
    path.write_text(text)
    return read_robot(path, Options(**options)).passive  # type: ignore[arg-type]


def test_urdf_and_its_simulators_say_what_joints_have_of_their_own(tmp_path: Path) -> None:
    text = robot(
        *map(link, "abc"),
        joint("ab", "a", "b", inner=HINGE),
        joint("bc", "b", "c", type="prismatic"),
        SPRING,
        ROTOR,
    )
    assert read(tmp_path / "arm.urdf", text) == (
        PassiveJoint("ab", 0, 1.0, 3.0, 0.4, 0.5, 0.2),
        PassiveJoint("bc", 1, 1.0, armature=0.5),
    )
    (held,) = read(tmp_path / "arm.urdf", text, lock={"ab": 0.1})
    assert held == PassiveJoint("bc", 0, 1.0, armature=0.5)


def test_joint_that_follows_another_has_its_rest_counted_from_its_offset(tmp_path: Path) -> None:
    follows = mimic("bc", -2.0, 0.3)
    text = robot(
        *map(link, "abc"), joint("ab", "a", "b", inner=follows + HINGE), joint("bc", "b", "c"), SPRING
    )
    (found,) = read(tmp_path / "arm.urdf", text)
    assert found == PassiveJoint("ab", 0, -2.0, 3.0, 0.4 - 0.3, 0.5, 0.2)


ARM = """schema = 1
name = "arm"
parameters = {{k = 2.0}}
joint = [{{name = "hinge", parent = "base", child = "rod", type = "{type}", {own}}}]
link = [{{name = "rod", mass = 1, com = [0.1, 0, 0], inertia = {{xx = 1, yy = 1, zz = 1}}}}]
"""


def test_toml_says_it_in_the_joints_table(tmp_path: Path) -> None:
    own = 'stiffness = 3, rest = "pi/2", damping = 0.5, friction = 0.2, armature = 0.01'
    (found,) = read(tmp_path / "arm.toml", ARM.format(type="revolute", own=own))
    rest = pytest.approx(1.5707963267948966)
    assert found == PassiveJoint("hinge", 0, 1.0, 3.0, rest, 0.5, 0.2, 0.01)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "own", "message"),
    [
        ("revolute", 'stiffness = "k"', "joint 'hinge': 'stiffness' takes a number only, without parameters"),
        ("ball", "damping = 1", "joint 'hinge' is ball, and only a joint of one axis takes 'damping'"),
        (
            "revolute",
            "damping = -1",
            "joint 'hinge' has a damping of -1, below 0; correct it, or pass --allow",
        ),
        (
            "revolute",
            "rest = nan",
            "joint 'hinge' has NaN or infinity among its springs and losses; give num",
        ),
    ],
)
def test_what_no_joint_has_is_named(kind: str, own: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match=message):
        read(tmp_path / "arm.toml", ARM.format(type=kind, own=own))


def test_losses_below_zero_are_taken_where_they_are_allowed(tmp_path: Path) -> None:
    text = ARM.format(type="revolute", own="damping = -1")
    (found,) = read(tmp_path / "arm.toml", text, allow_unphysical=True)
    assert found == PassiveJoint("hinge", 0, 1.0, damping=-1.0)


def test_numbers_that_the_format_does_not_have_are_told_as_ignored(tmp_path: Path) -> None:
    own = '<dynamics damping="0.5" mu_coulomb="3" K="7000"/>'
    (tmp_path / "arm.urdf").write_text(robot(*map(link, "ab"), joint("ab", "a", "b", inner=own)))
    notes = read_robot(tmp_path / "arm.urdf").notes
    ignored = {note.subject: note.detail for note in notes if note.kind == "ignored"}
    assert ignored == {
        "K of <dynamics>": "1 × in joint 'ab'",
        "mu_coulomb of <dynamics>": "1 × in joint 'ab'",
    }
