"""The checked-in packages are what the generator makes today."""

from pathlib import Path

import pytest
from linkwise import generate, read_system

GENERATED = Path(__file__).parents[2] / "generated"


@pytest.mark.parametrize("robot", ["planar3", "puma560", "torso"])
def test_checked_in_package_is_current(robot: str) -> None:
    folder = GENERATED / robot
    fresh = generate(read_system(robot))
    checked_in = {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    stale = sorted(path for path in fresh.keys() | checked_in if fresh.get(path) != checked_in.get(path))
    assert not stale, f"generated/{robot} is not current ({', '.join(stale[:3])}, …): run `make generate`"
