"""Output is a function of the input alone."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import DATA

SCRIPT = """
import hashlib, sys
from linkwise import Options, generate, read_system
for robot in sys.argv[1:]:
    files = generate(read_system(robot, Options("symbolic")))
    print(hashlib.sha256(repr(list(files.items())).encode()).hexdigest())
"""


@pytest.fixture(scope="module")
def digest() -> Callable[[Path, str], str]:
    def run(folder: Path, seed: str) -> str:
        folder.mkdir()
        (folder / "skew.toml").write_bytes((DATA / "skew.toml").read_bytes())
        (folder / "cart.py").write_bytes((DATA / "cart_pendulum.py").read_bytes())
        command = [sys.executable, "-c", SCRIPT, "planar3", "skew.toml", "cart.py"]
        environment = {"PYTHONHASHSEED": seed}
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    return run


def test_neither_hash_seed_nor_directory_matters(digest: Callable[[Path, str], str], tmp_path: Path) -> None:
    first = digest(tmp_path / "here", "0")
    assert len(first.split()) == 3
    assert first == digest(tmp_path / "elsewhere", "4711")
