"""What the chapters in docs/ show runs as printed."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import urdf_text
from compiled import STRICT
from conftest import needs_compiler
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

ROOT = Path(__file__).parents[1]


def blocks(chapter: str, language: str) -> list[str]:
    text = (ROOT / "docs" / chapter).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


@needs_compiler
def test_control_in_python_runs_as_printed() -> None:
    example = "\n".join(blocks("control.md", "python"))
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@needs_compiler
def test_control_in_c_compiles_as_printed_and_says_what_python_does(tmp_path: Path) -> None:
    constants, call = blocks("control.md", "c")[0].split("if (", 1)
    program = tmp_path / "main.c"
    program.write_text(
        f"""#include "planar3.h"
#include <stdio.h>
#include <stdlib.h>
#define stop() abort()
{constants}
int main(void)
{{
    const double q[] = {{0.3, 0.5, -0.2}}, qd[] = {{1, 0, 2}}, q_d[] = {{0.4, 0.4, 0}};
    double tau[3];
    if ({call}
    return printf("%.15g %.15g %.15g", tau[0], tau[1], tau[2]) < 0;
}}
""",
        encoding="utf-8",
    )
    c, made = ROOT / "generated/planar3/c", str(tmp_path / "main")
    compiled = ["gcc", "-std=c99", *STRICT, f"-I{c}", str(program), str(c / "planar3.c"), "-lm", "-o", made]
    subprocess.run(compiled, check=True)
    printed = subprocess.run([made], check=True, capture_output=True, text=True).stdout
    example = blocks("control.md", "python")[0] + "\nprint(*tau)"
    expected = subprocess.run(
        [sys.executable, "-c", example], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    for found, value in zip(printed.split(), expected.split(), strict=True):
        assert abs(float(found) - float(value)) < 1e-12


def in_shell(text: str, folder: Path) -> str:
    """What commands print, with this installation's `linkwise`."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["sh", "-e", "-c", text],
        cwd=folder,
        env=os.environ | {"PATH": path},
        check=True,
        capture_output=True,
        text=True,
    ).stdout


@needs_compiler
@pytest.mark.skipif(
    not all(map(shutil.which, ("cmake", "ninja", "make"))), reason="needs cmake, ninja and make"
)
def test_robots_in_builds_are_built_as_printed(tmp_path: Path) -> None:
    parts = [urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c")]
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(*parts))
    (tmp_path / "CMakeLists.txt").write_text(blocks("builds.md", "cmake")[0])
    (tmp_path / "main.c").write_text(blocks("builds.md", "c")[0])
    build, check = blocks("builds.md", "sh")
    printed = in_shell(build, tmp_path).splitlines()[-1]
    robot = generate(read_system(tmp_path / "arm.urdf"), ["numpy"], "arm_of_builds")
    write_package(robot, tmp_path / "arm_of_builds")
    numbers = import_package(tmp_path / "arm_of_builds").load("numpy")
    expected = numbers.inverse_dynamics([0.3, -0.7], [0.0, 0.0], [0.0, 0.0])
    assert [float(word) for word in printed.split()] == pytest.approx(list(expected), abs=1e-8)

    (tmp_path / "Makefile").write_text(blocks("builds.md", "make")[0])
    assert "linkwise generate" in in_shell("make", tmp_path)
    assert "up to date" in in_shell("make", tmp_path)
    assert in_shell(check, ROOT) == ""
