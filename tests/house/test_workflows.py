"""Workflows of the forge, which nothing here can run: their form, and that what they call is there."""

import os
import re
import shlex
import shutil
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
DEPENDABOT = ROOT / ".github/dependabot.yml"
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SOMEBODY = {
    f"GIT_{who}_{what}": "somebody@linkwise.example"
    for who in ("AUTHOR", "COMMITTER")
    for what in ("NAME", "EMAIL")
}
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
    assert objects(AUDIT, [*WORKFLOWS, DEPENDABOT]) == ""
    assert objects((*SCHEMA[:-1], "vendor.dependabot"), [DEPENDABOT]) == ""


@pytest.mark.parametrize(
    ("command", "before", "after", "said"),
    [
        (SCHEMA, "runs-on: ubuntu-24.04\n", "run-on: ubuntu-24.04\n", "run-on"),
        (AUDIT, "@de0fac2e4500dabe0009e67214ff5f5447ce83dd", "@main", "unpinned-uses"),
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
    local = called | {"./.ci/run", "./.github/site", "constraints.txt"}
    assert local <= files | called
    assert not [name for name in local if not (ROOT / name).is_file()]


def test_every_python_that_linkwise_is_for_is_tested_on_each_system() -> None:
    matrices = [
        job["strategy"]["matrix"] for name, job in jobs() if name in ("test.yml: linux", "test.yml: others")
    ]
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
        "docs.yml: publish": ["contents"],
        "release.yml: attest": ["attestations", "id-token"],
        "release.yml: publish": ["id-token"],
        "release.yml: tell": ["contents"],
    }


def job(name: str) -> dict[str, Any]:
    [found] = [each for place, each in jobs() if place == name]
    return found


def git(folder: Path, *arguments: str) -> str:
    command = ["git", *arguments]
    done = subprocess.run(
        command, cwd=folder, env=os.environ | SOMEBODY, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def shared(folder: Path) -> Path:
    """A clone of an empty repository, with a commit on main that is of version 1.2.0."""
    git(folder, "init", "--quiet", "--bare", "--initial-branch", "main", "origin")
    git(folder, "clone", "--quiet", "origin", "own")
    own = folder / "own"
    git(own, "switch", "--quiet", "--create", "main")
    version = own / "generator/linkwise_runtime/version.py"
    version.parent.mkdir(parents=True)
    version.write_text('"""Version."""\n\nVERSION = "1.2.0"\n', encoding="utf-8")
    git(own, "add", "--all")
    git(own, "commit", "--quiet", "--message", "First")
    git(own, "push", "--quiet", "origin", "main")
    return own


@pytest.mark.parametrize(
    ("tag", "is_on_main", "said"),
    [
        ("v1.2.0", True, ""),
        ("v1.2.1", True, "tag v1.2.1, but VERSION is 1.2.0"),
        ("1.2.0", True, "tag 1.2.0, but VERSION is 1.2.0"),
        ("v1.2.0", False, "v1.2.0: not on main"),
    ],
)
def test_a_release_begins_with_the_tag_of_its_version_on_main(
    tag: str, is_on_main: bool, said: str, tmp_path: Path
) -> None:
    own = shared(tmp_path)
    if not is_on_main:
        git(own, "commit", "--quiet", "--allow-empty", "--message", "Aside")
    [check] = [step["run"] for step in job("release.yml: tag")["steps"] if "run" in step]
    done = subprocess.run(
        ["bash", "-e", "-c", check],
        cwd=own,
        env=os.environ | {"GITHUB_REF_NAME": tag},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout.strip(), done.returncode) == (said, 1 if said else 0)


def test_nothing_of_a_release_runs_before_its_tag_is_checked() -> None:
    release = {name.removeprefix("release.yml: "): each for name, each in jobs() if name.startswith("rel")}

    def before(name: str) -> set[str]:
        needs = release[name].get("needs", [])
        own = {needs} if isinstance(needs, str) else set(needs)
        return own.union(*map(before, own))

    assert [name for name in release if name != "tag" and "tag" not in before(name)] == []


def test_no_two_distributions_are_published_in_one_environment() -> None:
    publish = job("release.yml: publish")
    distributions = [each["distribution"] for each in publish["strategy"]["matrix"]["include"]]
    assert sorted(distributions) == ["linkwise", "linkwise-runtime"]
    assert publish["environment"]["name"] == "pypi-${{ matrix.distribution }}"
    told = (ROOT / "release/README.md").read_text(encoding="utf-8")
    assert [name for name in distributions if f"`pypi-{name}`" not in told] == []


def test_what_is_published_of_a_distribution_is_its_wheel_and_its_archive(tmp_path: Path) -> None:
    publish = job("release.yml: publish")
    (tmp_path / "release").mkdir()
    wanted = {}
    for each in publish["strategy"]["matrix"]["include"]:
        name = each["files"]
        wanted[name] = {f"{name}-1.2.0.tar.gz", f"{name}-1.2.0-py3-none-any.whl"}
        for file in (*wanted[name], f"{name}-1.2.0.cdx.json"):
            (tmp_path / "release" / file).touch()
    [copy] = [step["run"] for step in publish["steps"] if "run" in step]
    for name, files in wanted.items():
        environment = os.environ | {"FILES": name}
        subprocess.run(["bash", "-e", "-c", copy], cwd=tmp_path, env=environment, check=True)
        assert {path.name for path in (tmp_path / "dist").iterdir()} == files
        shutil.rmtree(tmp_path / "dist")


def test_pages_of_versions_come_to_stand_side_by_side_on_their_branch(tmp_path: Path) -> None:
    own, site = shared(tmp_path), ROOT / ".github/site"
    (own / ".gitignore").write_text("out\n", encoding="utf-8")
    for version in ("1.2.0", "1.3.0"):
        shutil.rmtree(own / "out", ignore_errors=True)
        git(own, "fetch", "--quiet", "origin")
        subprocess.run(["bash", site, "fetch", "out/docs"], cwd=own, check=True)
        (own / "out/docs" / version / "_static").mkdir(parents=True)
        (own / "out/docs" / version / "_static/page.css").write_text(version, encoding="utf-8")
        (own / "out/docs/newest").write_text(version, encoding="utf-8")
        subprocess.run(
            ["bash", site, "keep", "out/docs", f"Pages of v{version}"],
            cwd=own,
            env=os.environ | SOMEBODY,
            check=True,
            capture_output=True,
        )
    git(own, "fetch", "--quiet", "origin")
    kept = git(own, "ls-tree", "-r", "--name-only", "origin/gh-pages").splitlines()
    assert kept == [".nojekyll", "1.2.0/_static/page.css", "1.3.0/_static/page.css", "newest"]
    assert git(own, "show", "origin/gh-pages:newest") == "1.3.0"
    told = git(own, "log", "--format=%s", "origin/gh-pages").splitlines()
    assert told == ["Pages of v1.3.0", "Pages of v1.2.0"]
    assert git(own, "status", "--porcelain") == "?? .gitignore"


@pytest.mark.parametrize(("required", "is_tested"), [("", True), ("all", False)])
def test_where_packages_are_absent_tests_run_unless_all_are_required(
    required: str, is_tested: bool, tmp_path: Path
) -> None:
    programs, script = tmp_path / "bin", tmp_path / ".ci/run"
    programs.mkdir()
    script.parent.mkdir()
    shutil.copy(ROOT / ".ci/run", script)
    for name, status in (("apt-get", 100), ("make", 0)):
        (programs / name).write_text(f'#!/bin/sh\necho {name} "$@" >> {tmp_path}/called\nexit {status}\n')
        (programs / name).chmod(0o755)
    for name in ("bash", "dirname"):
        (programs / name).symlink_to(str(shutil.which(name)))
    environment = {"PATH": str(programs), "LINKWISE_REQUIRE": required}
    done = subprocess.run(["bash", script], env=environment, capture_output=True, text=True, check=False)
    called = (tmp_path / "called").read_text(encoding="utf-8").splitlines()
    assert done.returncode == (0 if is_tested else 1)
    assert ("make test" in called) == is_tested
    assert "could not be installed" in done.stdout
    assert "strace" in done.stdout


def test_tests_of_main_run_to_their_end_and_none_may_lack_a_package() -> None:
    test = yaml.safe_load((FOLDER / "test.yml").read_text(encoding="utf-8"))
    assert test["concurrency"]["cancel-in-progress"] == "${{ github.event_name == 'pull_request' }}"
    for name in ("docs.yml", "release.yml"):
        assert not yaml.safe_load((FOLDER / name).read_text(encoding="utf-8"))["concurrency"][
            "cancel-in-progress"
        ]
    [run] = [step["run"] for step in job("test.yml: linux")["steps"] if "run" in step]
    assert "LINKWISE_REQUIRE=all ./.ci/run" in run
