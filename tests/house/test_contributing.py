"""CONTRIBUTING.md, SECURITY.md, forms and fragments lead to what is there, and their tools read them."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from linkwise import LinkwiseError, read_robot
from linkwise.analysis.show import check_figure
from linkwise.cli.app import COMMANDS
from linkwise.emit.backend import BACKENDS
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
PROGRAMS = Path(sys.executable).parent
FORGE = ROOT / ".github"
FORMS = sorted(path for path in (FORGE / "ISSUE_TEMPLATE").glob("*.yml") if path.name != "config.yml")
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["towncrier"]


def form(name: str) -> dict[str, Any]:
    """Return the fields of a form, by their ids."""
    text = (FORGE / "ISSUE_TEMPLATE" / f"{name}.yml").read_text(encoding="utf-8")
    return {field["id"]: field for field in YAML(typ="safe").load(text)["body"] if "id" in field}


def required(fields: dict[str, Any]) -> set[str]:
    return {name for name, field in fields.items() if field.get("validations", {}).get("required")}


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "SECURITY.md", "docs/deprecation.md"])
def test_every_path_and_target_that_is_named_is_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:tests|docs|generator|examples|\.devcontainer)/[\w/.-]+)`", text))
    assert not [path for path in named if not (ROOT / path).exists()]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    asked = set(re.findall(r"(?:^|`)make ([\w-]+)$|`make ([\w-]+)`", text, re.MULTILINE))
    assert {first or second for first, second in asked} <= set(
        re.findall(r"^([\w-]+):", makefile, re.MULTILINE)
    )
    assert named | asked


def test_setting_up_makes_what_the_makefile_makes() -> None:
    plain = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    done = subprocess.run(
        ["make", "--dry-run", "--always-make", ".venv/.ready", "lint"],
        cwd=ROOT,
        env=plain,  # as of no `make` that runs this test with variables of its own
        capture_output=True,
        text=True,
        check=True,
    )
    assert ".venv/bin/python -m pip install" in done.stdout
    assert ".venv/bin/mypy" in done.stdout


def test_first_issues_are_gaps_still(tmp_path: Path) -> None:
    """Whoever closes one puts another into its place."""
    (tmp_path / "arm.urdf").write_text(
        '<robot name="arm"><link name="a"><inertial><origin quat_xyzw="0 0 0 1"/><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    with pytest.raises(LinkwiseError, match="quat_xyzw=…, which is not read"):
        read_robot(tmp_path / "arm.urdf")
    assert "javascript" not in BACKENDS
    assert not list((ROOT / "docs").glob("*drake*"))
    systems = (ROOT / "docs/systems.md").read_text(encoding="utf-8")
    assert "Nothing has run on Windows or macOS themselves yet" in systems
    robot: Any = SimpleNamespace(driven_joints=("elbow",), contacts=None)
    check_figure("causes:elbow", robot, {})
    check_figure("power", robot, {})
    with pytest.raises(LinkwiseError, match="--figure power:elbow: give one of"):
        check_figure("power:elbow", robot, {})


@pytest.mark.parametrize(
    ("schema", "files"),
    [
        ("vendor.github-issue-forms", FORMS),
        ("vendor.github-issue-config", [FORGE / "ISSUE_TEMPLATE/config.yml"]),
        ("vendor.citation-file-format", [ROOT / "CITATION.cff"]),
    ],
)
def test_files_for_the_forge_are_of_their_schemas(schema: str, files: list[Path]) -> None:
    check = [PROGRAMS / "check-jsonschema", "--builtin-schema", schema, "--force-filetype", "yaml"]
    done = subprocess.run([*check, *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_a_form_that_is_wrong_would_be_refused(tmp_path: Path) -> None:
    text = FORMS[0].read_text(encoding="utf-8")
    (tmp_path / "form.yml").write_text(text.replace("type: textarea", "type: text area", 1))
    check = [PROGRAMS / "check-jsonschema", "--builtin-schema", "vendor.github-issue-forms"]
    done = subprocess.run([*check, tmp_path / "form.yml"], capture_output=True, text=True, check=False)
    assert done.returncode == 1


def test_a_wrong_number_is_asked_for_with_all_that_shows_it() -> None:
    fields = form("wrong-number")
    assert required(fields) == {"bundle", "command", "got", "expected", "oracle", "versions"}
    assert {"Pinocchio", "MuJoCo", "OpenSim"} <= set(fields["oracle"]["attributes"]["options"])


def test_a_robot_is_asked_for_in_every_format_that_is_read() -> None:
    fields = form("unreadable-robot")
    assert required(fields) == {"format", "robot", "said", "expected", "versions"}
    assert {"URDF", "MJCF", "SDFormat", "OpenSim", "TOML"} < set(fields["format"]["attributes"]["options"])


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_commands_in_forms_are_linkwises(path: Path) -> None:
    named = set(re.findall(r"`linkwise (\w+)", path.read_text(encoding="utf-8")))
    assert named <= set(COMMANDS)


def fragments(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.name not in SETTINGS["ignore"]]


def build(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [PROGRAMS / "towncrier", "build", "--version", "9.1.0", "--dir", folder, *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """All that towncrier reads, without fragments."""
    for name in ("pyproject.toml", "CHANGELOG.md"):
        shutil.copyfile(ROOT / name, tmp_path / name)
    (tmp_path / "changes").mkdir()
    shutil.copyfile(ROOT / "changes/README.md", tmp_path / "changes/README.md")
    return tmp_path


def test_fragments_become_the_newest_section_of_the_changelog(checkout: Path) -> None:
    kinds = [kind["directory"] for kind in SETTINGS["type"]]
    named = CONTRIBUTING.partition("The kinds are")[2].partition("`.venv")[0]
    assert re.findall(r"`(\w+)`", named) == kinds
    for kind in kinds:
        (checkout / f"changes/+word.{kind}.md").write_text(f"A line on a {kind}.\n")
    before = (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    done = build(checkout, "--yes")
    assert done.returncode == 0, done.stderr
    after = (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    start = SETTINGS["start_string"]
    assert after.startswith(before.partition(start)[0])
    assert after.endswith(before.partition(start)[2].lstrip("\n"))
    new = after.removeprefix(before.partition(start)[0]).removesuffix(before.partition(start)[2])
    assert re.findall(r"^#+ (.+)$", new, re.MULTILINE) == ["9.1.0", *(k["name"] for k in SETTINGS["type"])]
    assert re.findall(r"^- (.+)$", new, re.MULTILINE) == [f"A line on a {kind}." for kind in kinds]
    assert not fragments(checkout / "changes")


def test_a_fragment_of_no_known_kind_is_refused(checkout: Path) -> None:
    (checkout / "changes/+word.improvement.md").write_text("Lost, if nobody told.\n")
    done = build(checkout, "--draft")
    assert done.returncode != 0
    assert "improvement" in done.stdout + done.stderr


def test_fragments_of_this_checkout_can_be_built() -> None:
    done = build(ROOT, "--draft")
    assert done.returncode == 0, done.stderr
    assert all(path.read_text(encoding="utf-8").strip() for path in fragments(ROOT / "changes"))
