"""What the README shows works as printed."""

import re
import subprocess
import sys
from pathlib import Path

from linkwise import Options, generate, read_system

ROOT = Path(__file__).parents[1]


def blocks(language: str) -> list[str]:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_python_example_runs_as_printed() -> None:
    example = blocks("python")[0]
    assert len(example.strip().splitlines()) <= 10
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.match(r"joint 1 carries -?\d+\.\d+ N m", done.stdout)


def test_toml_example_is_a_robot(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(blocks("toml")[0], encoding="utf-8")
    assert generate(read_system(tmp_path / "arm.toml", Options("symbolic")), ["numpy"])


def test_energies_example_is_a_system(tmp_path: Path) -> None:
    (tmp_path / "cart.py").write_text(blocks("python")[1], encoding="utf-8")
    assert len(read_system(tmp_path / "cart.py").links) == 2


def test_every_command_is_in_the_table() -> None:
    command = [sys.executable, "-m", "linkwise", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    names = re.findall(r"^│ (\w+) ", done.stdout, flags=re.MULTILINE)
    assert {"generate", "check", "inspect"} <= set(names)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in names:
        assert f"| `linkwise {name} " in text, name
