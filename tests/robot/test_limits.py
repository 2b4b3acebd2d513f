"""Limits and names of joints: from each format into the manifest, Python, the C header and `inspect`."""

import json
import subprocess
from math import inf
from pathlib import Path

import pytest
from conftest import needs_compiler
from helpers import urdf_text
from helpers.command_line import run_linkwise
from helpers.compiled import STRICT
from helpers.kept import run_kept
from linkwise import LinkwiseError, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest
from linkwise.robot import Options, read_robot

NONE = (-inf, inf, inf, inf)


def limits_of(path: Path, options: Options | None = None) -> list[tuple[float, ...]]:
    robot = read_robot(path, options)
    return [(x.lower, x.upper, x.velocity, x.effort) for x in robot.joint_limits]


def urdf(*limits: str, type: str = "revolute") -> str:
    usual = '<limit lower="-9" upper="9" effort="9" velocity="9"/>'
    joints = [urdf_text.joint(f"j{k}", "abcd"[k], "abcd"[k + 1], type=type) for k in range(len(limits))]
    return urdf_text.chain(
        *(joint.replace(usual, limit) for joint, limit in zip(joints, limits, strict=True))
    )


def test_urdf_gives_them_and_what_is_left_out_is_infinite(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    whole = '<limit lower="-1.5" upper="2" effort="87" velocity="2.1"/>'
    path.write_text(urdf(whole, '<limit effort="5" velocity="3"/>', ""))
    assert limits_of(path) == [(-1.5, 2.0, 2.1, 87.0), (-inf, inf, 3.0, 5.0), NONE]
    path.write_text(urdf(whole, type="continuous"))
    assert limits_of(path) == [(-inf, inf, 2.1, 87.0)]


def test_a_follower_has_none_a_held_joint_is_gone_and_a_floating_base_has_none(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    first = urdf_text.joint("ab", "a", "b")
    second = urdf_text.joint("bc", "b", "c", inner=urdf_text.mimic("ab", 2.0)).replace('"9"', '"1"')
    path.write_text(urdf_text.chain(first, second))
    assert limits_of(path) == [(-9.0, 9.0, 9.0, 9.0)]
    assert limits_of(path, Options(base="floating")) == [*[NONE] * 6, (-9.0, 9.0, 9.0, 9.0)]
    path.write_text(urdf('<limit lower="0" upper="1" effort="2" velocity="3"/>', ""))
    assert limits_of(path, Options(lock={"j0": 0.5})) == [NONE]


def test_sdformat_has_numbers_that_mean_none(tmp_path: Path) -> None:
    body = "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>"
    limit = "<lower>-1</lower><upper>1e16</upper><effort>-1</effort><velocity>2</velocity>"
    (tmp_path / "arm.sdf").write_text(
        f'<sdf version="1.9"><model name="arm"><link name="a">{body}</link>'
        '<joint name="j" type="revolute"><parent>world</parent><child>a</child>'
        f"<axis><xyz>0 1 0</xyz><limit>{limit}</limit></axis></joint></model></sdf>"
    )
    assert limits_of(tmp_path / "arm.sdf") == [(-1.0, inf, 2.0, inf)]


def test_mjcf_has_a_range_and_a_range_of_forces(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    geom = '<geom size="0.1"/>'
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body name="a"><joint name="j" axis="0 1 0" range="-90 45" '
        f'actuatorfrcrange="-5 7"/>{geom}<body name="b"><joint name="k" type="slide" axis="0 1 0"/>{geom}'
        "</body></body></worldbody></mujoco>"
    )
    first, second = limits_of(tmp_path / "arm.xml")
    assert first == pytest.approx((-1.5707963267948966, 0.7853981633974483, inf, 5.0))
    assert second == NONE


ARM = """schema = 1
name = "arm"
[[link]]
name = "upper"
mass = 1.2
com = [0.15, 0, 0]
inertia = { xx = 0.001, yy = 0.01, zz = 0.01 }
[[joint]]
name = "shoulder \\"left\\"?"
parent = "base"
child = "upper"
axis = [0, 1, 0]
lower = -1.5
upper = 0.25
effort = 40
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "arm.toml").write_text(ARM)
    return tmp_path / "arm.toml"


def test_toml_has_them_and_the_package_shows_them(arm: Path, tmp_path: Path) -> None:
    assert limits_of(arm) == [(-1.5, 0.25, inf, 40.0)]
    write_package(generate(read_system(arm), ["numpy"]), tmp_path / "arm")
    robot = import_package(tmp_path / "arm").load("numpy")
    assert robot.joint_limits == ((-1.5,), (0.25,), (inf,), (40.0,))
    assert robot.joint_limits.upper == (0.25,)
    (joint,) = Manifest.read(tmp_path / "arm").joints
    assert (joint.lower, joint.upper, joint.velocity, joint.effort) == (-1.5, 0.25, None, 40.0)
    assert run_linkwise("check", "arm", "--samples", "1", folder=tmp_path).stdout.count("FAIL") == 0


@needs_compiler
@pytest.mark.parametrize(
    "compiler", [("gcc", "-std=c99"), ("g++", "-x", "c++", "-std=c++17")], ids=["c", "c++"]
)
def test_the_header_has_names_and_limits(compiler: tuple[str, ...], arm: Path, tmp_path: Path) -> None:
    write_package(generate(read_system(arm), ["c"]), tmp_path / "arm")
    (tmp_path / "main.c").write_text(
        '#include "arm.h"\n#include <stdio.h>\nint main(void)\n{\n'
        '    return printf("%s %g %g %g %g", arm_joint_names[0], arm_lower_limit[0], arm_upper_limit[0],\n'
        "        arm_velocity_limit[0], arm_effort_limit[0]) < 0;\n}\n"
    )
    (tmp_path / "unused.c").write_text(
        '#include "arm.h"\nint unused(void);\nint unused(void) { return ARM_JOINTS; }\n'
    )
    command = [*compiler, *STRICT, f"-I{tmp_path / 'arm/c'}"]
    run_kept([*command, "-c", tmp_path / "unused.c"], tmp_path / "unused.o")
    run_kept([*command, tmp_path / "main.c"], tmp_path / "main")
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    assert said == 'shoulder "left"? -1.5 0.25 inf 40'


def test_inspect_shows_them(arm: Path, tmp_path: Path) -> None:
    shown = run_linkwise("inspect", "arm.toml", folder=tmp_path).stdout
    assert '1  shoulder "left"? [rad]  (-1.5 to 0.25 rad, 40 N·m)\n' in shown
    (joint,) = json.loads(run_linkwise("inspect", "arm.toml", "--json", folder=tmp_path).stdout)["joints"]
    assert joint["velocity"] is None
    assert joint["effort"] == 40.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (urdf('<limit lower="low"/>'), "<limit lower='low'> needs 1 number"),
        (urdf('<limit upper="nan"/>'), "joint 'j0' has NaN for a limit; give a number, or leave it out"),
    ],
)
def test_a_limit_that_is_no_number_is_refused_by_name(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        read_robot(tmp_path / "arm.urdf")
    assert message in str(caught.value)
