"""Entries that a file in TOML may leave out: the table in docs/robots.md."""

import re
from pathlib import Path

import pytest
from linkwise.robot.description import Description
from linkwise.robot.readers.toml.reader import JOINT, LINK, TOP, read_toml

PAGE = Path(__file__).parents[2] / "docs/robots.md"
ROWS = re.findall(r"^\| (\w+) \| `(\w+)` \| `(.+?)` \|", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
ELSEWHERE = {
    *("schema", "name", "parent", "child", "mimic", "parameters", "link", "joint", "constraint"),
    *("independent", "allow_unphysical"),
}
"""Keys that must be given, or are tables that may be left out."""
OTHER = {"revolute": "prismatic", "base": "ground"}


def told(folder: Path, given: list[tuple[str, str, str]]) -> Description:
    """A file that says these keys of its tables, beside what it must say."""
    said = {
        at: [f"{key} = {value}" for of, key, value in given if of == at] for at in ("file", "link", "joint")
    }
    link = ", ".join(['name = "upper"', *said["link"]])
    joint = ", ".join(['name = "shoulder", parent = "base", child = "upper"', *said["joint"]])
    lines = ["schema = 1", *said["file"], f"link = [{{ {link} }}]", f"joint = [{{ {joint} }}]"]
    path = folder / "arm.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return read_toml(path)


def test_the_page_has_what_every_key_is_unless_given(tmp_path: Path) -> None:
    assert sorted(key for _, key, _ in ROWS) == sorted({*TOP, *LINK, *JOINT} - ELSEWHERE)
    assert told(tmp_path, ROWS) == told(tmp_path, [])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[1])
def test_another_value_makes_another_robot(row: tuple[str, str, str], tmp_path: Path) -> None:
    table, key, value = row
    other = re.sub(r"-?[\d.]+|-?inf|(?<=\")\w+", lambda found: OTHER.get(found[0], "7"), value)
    assert told(tmp_path, [(table, key, other)]) != told(tmp_path, [])


def test_a_mimic_joint_follows_as_it_is_unless_told_otherwise(tmp_path: Path) -> None:
    assert "multiplier = 1, offset = 0" in PAGE.read_text(encoding="utf-8")
    plain = told(tmp_path, [("joint", "mimic", '{ joint = "elbow" }')])
    assert told(tmp_path, [("joint", "mimic", '{ joint = "elbow", multiplier = 1, offset = 0 }')]) == plain
