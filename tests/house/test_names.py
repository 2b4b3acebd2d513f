"""Any name from a file is data: quoted where it is shown, never code, and never mixed up with another."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest
from helpers.answers import random_states
from helpers.compiled import compile_library
from linkwise import Options, check_package, generate, read_system, write_package
from linkwise.emit.assemble import checked_identifier
from linkwise.package.load import import_package

HOSTILE = (
    "quote\" and ' and \\",
    '"""; import os; os.abort()  # """',
    "*/ int main(void) { abort(); } /*",
    "line\nbreak\r\n#define real int",
    "class",
    "日本語 ∂τ",
    "{{ 7 * 7 }} {% raw %}",
    "\\input{/etc/passwd} %",
    "../../escape",
    "q1",
    "s2",
    "d(q1)/dt",
    "x" * 300,
)
PART = """
[[link]]
name = {link}
mass = 1.0
com = [0.1, 0.02, 0.0]
inertia = {{ xx = 0.1, yy = 0.1, zz = 0.1 }}

[[joint]]
name = {joint}
parent = {parent}
child = {link}
xyz = [0.3, 0, 0]
rpy = [0.3, 0, 0]
"""


def quoted(text: str) -> str:
    """A TOML string."""
    return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08X}" for c in text) + '"'


def chain(robot: str, names: tuple[str, ...]) -> str:
    text, parent = f"schema = 1\nname = {quoted(robot)}\n", "base"
    for name in names:
        text += PART.format(link=quoted(name), joint=quoted(name), parent=quoted(parent))
        parent = name
    return text


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    path = tmp_path_factory.mktemp("hostile") / "robot.toml"
    beside, *along = HOSTILE[:3]
    text = chain(HOSTILE[1], tuple(along))
    text += PART.format(link=quoted(beside), joint=quoted(beside), parent=quoted("base"))
    path.write_text(text, encoding="utf-8")
    return generate(read_system(path, Options("symbolic")))


def test_names_come_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(chain("hostile", HOSTILE), encoding="utf-8")
    files = generate(read_system(path), ["numpy", "autograd", "c"])
    write_package(files, tmp_path / "hostile")
    package = import_package(tmp_path / "hostile")
    assert package.joint_names == package.link_names == HOSTILE
    robot = package.load("numpy")
    assert robot.partial_torque(*random_states(robot.n, 1)).shape == (1, 13, 13)


def test_python_holds_them_in_string_literals_only(hostile: dict[str, str]) -> None:
    for path, text in hostile.items():
        if path.endswith(".py"):
            ast.parse(text)
            code = [t.string for t in tokenize.generate_tokens(io.StringIO(text).readline)]
            assert "abort" not in code, path


def test_c_and_formulas_do_not_take_them_as_code(hostile: dict[str, str], tmp_path: Path) -> None:
    write_package(hostile, tmp_path / "hostile")
    compile_library(tmp_path / "hostile", tmp_path / "library.so")
    for path in hostile:
        if path.startswith("c/"):
            code = re.sub(r'/\*.*?\*/|"[^"\n]*"', "", hostile[path], flags=re.S)
            assert not re.search(r"\b(abort|main)\b", code), path
    for line in hostile["formulas.tex"].splitlines():
        assert line.startswith(("%", r"\[")), line


@pytest.mark.parametrize(
    "joints",
    [
        ("s1", "s2", "s3"),
        ("c1", "w1_x", "w2_z"),
        ("u1", "v1_y", "a2_x"),
        ("a", "d(a)/dt", "d²(a)/dt²"),
        ("m_arm", "c_elbow_x", "p_hand_x"),
    ],
)
@pytest.mark.parametrize("parameters", ["numeric", "symbolic"])
def test_a_joint_may_be_called_like_anything_inside(
    joints: tuple[str, ...], parameters: str, tmp_path: Path
) -> None:
    path = tmp_path / "robot.toml"
    text = chain("clash", ("arm", "elbow", "hand"))
    for link, joint in zip(("arm", "elbow", "hand"), joints, strict=True):
        text = text.replace(f'[[joint]]\nname = "{link}"', f"[[joint]]\nname = {quoted(joint)}")
    path.write_text(text, encoding="utf-8")
    write_package(generate(read_system(path, Options(parameters)), ["numpy", "autograd"]), tmp_path / "clash")
    failed = [result for result in check_package(tmp_path / "clash", 5) if result.failed]
    assert not failed


@pytest.mark.parametrize(
    ("name", "module"),
    [("Arm 2 (left)", "arm_2_left"), ("7dof", "robot_7dof"), ("class", "robot_class"), ("∂", "robot")],
)
def test_robots_name_becomes_a_module_name(name: str, module: str) -> None:
    from linkwise.emit.assemble import identifier

    assert identifier(name) == module
    assert module.isidentifier()


def test_a_package_may_have_a_name_of_sixty_letters() -> None:
    assert checked_identifier("a" * 60, "robot") == "a" * 60
