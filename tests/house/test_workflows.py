"""Workflows of the forge, which nothing here can run: their form, and that what they call is there."""

import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".github/workflows"
WORKFLOWS = sorted(FOLDER.glob("*.yml"))
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROGRAMS = Path(sys.executable).parent
SCHEMA = (PROGRAMS / "check-jsonschema", "--builtin-schema", "vendor.github-workflows")
AUDIT = (PROGRAMS / "zizmor", "--offline", "--no-progress", "--strict-collection")


def objects(command: tuple[Path | str, ...], files: list[Path]) -> str:
    """Return what a checker says against files; nothing where it ends well."""
    done = subprocess.run([*command, *files], capture_output=True, text=True, check=False)
    return done.stdout + done.stderr if done.returncode else ""


def jobs() -> Iterator[tuple[str, dict[str, Any]]]:
    for path in WORKFLOWS:
        for name, job in yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].items():
            yield f"{path.name}: {name}", job


def commands() -> Iterator[str]:
    for _, job in jobs():
        yield from (step["run"] for step in job.get("steps", ()) if "run" in step)


def test_the_forges_schema_and_an_audit_take_every_workflow() -> None:
    assert {path.name for path in WORKFLOWS} >= {"test.yml", "docs.yml", "release.yml"}
    assert objects(SCHEMA, WORKFLOWS) == ""
    assert objects(AUDIT, WORKFLOWS) == ""


@pytest.mark.parametrize(
    ("command", "before", "after", "said"),
    [
        (SCHEMA, "runs-on: ubuntu-24.04\n", "run-on: ubuntu-24.04\n", "run-on"),
        (AUDIT, "@11bd71901bbe5b1630ceea73d27597364c9af683", "@main", "unpinned-uses"),
        (AUDIT, 'create "$TAG"', 'create "${{ github.ref_name }}"', "template-injection"),
    ],
    ids=["a job without a machine", "an action at a branch", "a name that is run"],
)
def test_a_slip_in_a_workflow_is_found(
    command: tuple[Path | str, ...], before: str, after: str, said: str, tmp_path: Path
) -> None:
    text = (FOLDER / "release.yml").read_text(encoding="utf-8")
    assert before in text
    slip = tmp_path / ".github/workflows/release.yml"
    slip.parent.mkdir(parents=True)
    slip.write_text(text.replace(before, after), encoding="utf-8")
    assert said in objects(command, [slip])


def test_what_workflows_call_is_there() -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    extras = set(SETTINGS["project"]["optional-dependencies"])
    words = [word for command in commands() for word in shlex.split(command)]
    made = {after for word, after in pairwise(words) if word == "make"}
    assert made == {"docs", "release"}
    assert made <= targets
    asked = {
        name for word in words for name in ",".join(re.findall(r"^\.\[(.+)\]$", word)).split(",") if name
    }
    assert asked == {"all", "test", "release"}
    assert asked <= extras
    modules = {after for word, after in pairwise(words) if word == "-m"}
    assert "release.conda_recipe" in modules
    for module in modules - {"pip", "pytest", "not (ship or browser)"}:
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file(), module
    files = {word for word in words if re.match(r"(?:\./)?\.?[\w/]+/[\w.]+$|constraints", word)}
    assert {"./.ci/run", "constraints.txt"} <= files
    called = {job["uses"].removeprefix("$/") for _, job in jobs() if "uses" in job}
    assert called == {".github/workflows/test.yml"}
    local = called | {"./.ci/run", "constraints.txt"}
    assert not [name for name in local if not (ROOT / name).is_file()]


def test_every_python_that_linkwise_is_for_is_tested_on_each_system() -> None:
    matrices = [job["strategy"]["matrix"] for _, job in jobs() if "strategy" in job]
    linux, others = sorted(matrices, key=lambda matrix: len(matrix["python"]), reverse=True)
    assert linux["python"] == ["3.11", "3.12", "3.13", "3.14"]
    assert set(others["python"]) <= set(linux["python"])
    assert SETTINGS["project"]["requires-python"] == f">={linux['python'][0]}"
    systems = {re.split(r"-", name)[0] for name in (*linux["machine"], *others["machine"])}
    assert systems == {"ubuntu", "macos", "windows"}
    assert any(name.endswith("-arm") for name in linux["machine"])


def test_no_workflow_has_a_secret_and_only_those_that_publish_write() -> None:
    assert not [path.name for path in WORKFLOWS if "secrets." in path.read_text(encoding="utf-8")]
    writing = {
        name: sorted(key for key, value in job["permissions"].items() if value == "write")
        for name, job in jobs()
        if "write" in job["permissions"].values()
    }
    assert writing == {
        "docs.yml: publish": ["id-token", "pages"],
        "release.yml: attest": ["attestations", "id-token"],
        "release.yml: publish": ["id-token"],
        "release.yml: tell": ["contents"],
    }
