"""Code of docs/ that is no program of its own; tests/house/test_pages.py runs the rest."""

import subprocess
import sys
from pathlib import Path

from conftest import needs_compiler
from helpers.compiled import STRICT
from helpers.kept import run_kept
from tools import pages

ROOT = Path(__file__).parents[2]


def blocks(chapter: str, language: str) -> list[str]:
    return [block.text for block in pages.blocks(ROOT / "docs" / chapter) if block.language == language]


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
    c, made = ROOT / "generated/planar3/c", tmp_path / "main"
    run_kept(["gcc", "-std=c99", *STRICT, f"-I{c}", program, c / "planar3.c", "-lm"], made)
    printed = subprocess.run([made], check=True, capture_output=True, text=True).stdout
    example = blocks("control.md", "python")[0] + "\nprint(*tau)"
    expected = subprocess.run(
        [sys.executable, "-c", example], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    for found, value in zip(printed.split(), expected.split(), strict=True):
        assert abs(float(found) - float(value)) < 1e-12
