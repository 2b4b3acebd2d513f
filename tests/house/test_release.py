"""A release up to the upload, in a repository of its own: what is made, and what is refused."""

import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from helpers.installation import ROOT, copied
from linkwise import LinkwiseError
from linkwise_runtime.version import VERSION

from release.checkout import is_breaking_told, objections
from release.public_face import public_face, written
from release.recorded_faces import FOLDER, broken, record, untold
from release.recorded_faces import objections as face_objections

pytestmark = pytest.mark.ship
SOMEBODY = {
    f"GIT_{who}_{what}": "somebody@linkwise.example"
    for who in ("AUTHOR", "COMMITTER")
    for what in ("NAME", "EMAIL")
}


def git(folder: Path, *arguments: str) -> None:
    subprocess.run(
        ["git", *arguments], cwd=folder, env=os.environ | SOMEBODY, check=True, capture_output=True
    )


def changed(path: Path, before: str, after: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")


def committed(folder: Path) -> Path:
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "All of it")
    return folder


@pytest.fixture(scope="session")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository with this checkout, in which nothing speaks against a release."""
    folder = copied(tmp_path_factory.mktemp("repository") / "linkwise")
    for fragment in (folder / "changes").glob("*.*.md"):
        fragment.unlink()
    (folder / "CHANGELOG.md").write_text(f"# Changes\n\n## {VERSION}\n\n- All of it.\n", encoding="utf-8")
    git(folder, "init", "--quiet")
    record(folder)
    return committed(folder)


@pytest.fixture
def repository(ready: Path, tmp_path: Path) -> Path:
    git(tmp_path, "clone", "--quiet", str(ready), "own")
    return tmp_path / "own"


def test_a_release_is_made_up_to_the_upload(ready: Path) -> None:
    command = [sys.executable, "-m", "release"]
    done = subprocess.run(command, cwd=ready, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert f"git push origin v{VERSION}" in done.stdout
    out = ready / "out/release"
    subprocess.run(
        ["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=out, check=True, capture_output=True
    )
    assert all(path.is_file() for path in out.iterdir()), "the forge's release has no folders"
    names = {path.name for path in out.iterdir()}
    assert (out / "NOTES.md").read_text() == "- All of it.\n"
    listed = re.findall(r"^[0-9a-f]{64}  (.+)$", (out / "SHA256SUMS").read_text(), re.MULTILINE)
    assert {*listed, "SHA256SUMS"} == names
    for own, recipe in (("linkwise", "linkwise"), ("linkwise_runtime", "linkwise-runtime")):
        wheel = out / f"{own}-{VERSION}-py3-none-any.whl"
        assert (
            f"\nVersion: {VERSION}\n"
            in zipfile.Path(wheel, f"{own}-{VERSION}.dist-info/METADATA").read_text()
        )
        time = subprocess.run(
            ["git", "log", "-1", "--format=%ct"], cwd=ready, capture_output=True, check=True
        )
        with tarfile.open(out / f"{own}-{VERSION}.tar.gz") as sources:
            members = sources.getmembers()
        assert {(member.mtime, member.uid, member.uname) for member in members} == {(int(time.stdout), 0, "")}
        bill = json.loads((out / f"{own}-{VERSION}.cdx.json").read_text())
        assert bill["metadata"]["component"]["name"] == recipe
        assert bill["metadata"]["component"]["version"] == VERSION
        needs = {"numpy"} if own == "linkwise_runtime" else {"numpy", "sympy", "mpmath", "typer"}
        brought = {component["name"] for component in bill["components"]}
        assert needs <= brought
        assert not {"pytest", "torch"} & brought
        says = yaml.safe_load((out / f"{recipe}.recipe.yaml").read_text())
        assert says["package"] == {"name": recipe, "version": VERSION}
        assert (out / says["source"]["path"]).is_file()
        assert {"python >=3.11", "numpy >=2"} <= set(says["requirements"]["run"])
    assert (out / f"linkwise-{VERSION}.api.json").read_bytes() == (
        ready / FOLDER / f"{VERSION}.json"
    ).read_bytes()


def left_about(folder: Path) -> None:
    (folder / "left-about.txt").write_text("draft", encoding="utf-8")


def tagged(folder: Path) -> None:
    git(folder, "tag", f"v{VERSION}")
    git(folder, "commit", "--quiet", "--allow-empty", "--message", "Later")


def tagged_as_another(folder: Path) -> None:
    git(folder, "tag", "v9.9.9")


def untold_version(folder: Path) -> None:
    changed(folder / "CHANGELOG.md", f"## {VERSION}", "## 0.0.1")
    committed(folder)


def said_to_be_unpublished(folder: Path) -> None:
    changed(folder / "CHANGELOG.md", "- All of it.", "Not yet.\n\nThe first version; not published yet.")
    committed(folder)


def fragment(folder: Path) -> None:
    (folder / "changes").mkdir(exist_ok=True)
    (folder / "changes/41.feature.md").write_text("Something new.", encoding="utf-8")
    committed(folder)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (left_about, "left-about.txt: not committed; commit or remove it"),
        (tagged, f"version {VERSION} is tagged already, at another commit; raise VERSION"),
        (tagged_as_another, f"the last commit is tagged v9.9.9, and is of version {VERSION}; remove the tag"),
        (untold_version, f"CHANGELOG.md: begins with no section of {VERSION}; tell there what changed"),
        (
            said_to_be_unpublished,
            f"CHANGELOG.md: says that {VERSION} is not published yet; remove these words",
        ),
        (fragment, "changes/: 41.feature.md not told in CHANGELOG.md yet; run towncrier build"),
    ],
)
def test_what_speaks_against_a_release_is_told_by_name(
    make: Callable[[Path], None], said: str, repository: Path
) -> None:
    assert list(objections(repository)) == []
    make(repository)
    [line] = objections(repository)
    assert said in line


def test_a_refused_release_ends_with_status_2_and_makes_nothing(repository: Path) -> None:
    changed(
        repository / "generator/linkwise/package_cache.py", "def kept_package(", "def kept_package(new: int, "
    )
    done = subprocess.run(
        [sys.executable, "-m", "release"], cwd=repository, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert not (repository / "out").exists()
    assert "generator/linkwise/package_cache.py: not committed" in done.stderr
    assert f"{FOLDER}/{VERSION}.json: is not the public face of this checkout" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_change_that_breaks_users_is_told_and_raises_more_than_the_last_number(repository: Path) -> None:
    version = repository / "generator/linkwise_runtime/version.py"
    changed(version, f'"{VERSION}"', '"0.1.99"')
    changed(repository / "CHANGELOG.md", f"## {VERSION}", "## 0.1.99")
    changed(
        repository / "generator/linkwise/package_cache.py", "def kept_package(", "def kept_package(new: int, "
    )
    changed(repository / "generator/linkwise_runtime/dynamics.py", "def gravity_torque(", "def weight(")
    record(repository)
    face = public_face(repository)
    lines = list(face_objections(repository, face))
    assert any(line.startswith("linkwise.kept_package(new)") for line in lines), lines
    assert any("gravity_torque" in line for line in lines), lines
    assert all(f"breaks users of {VERSION}" in line for line in lines)
    assert "0.1.99 breaks users" in lines[-1]
    changed(repository / "CHANGELOG.md", "- All of it.", "### Breaking\n\n- All of it.")
    assert list(face_objections(repository, face)) == lines[-1:]
    changed(version, '"0.1.99"', '"0.2.0"')
    changed(repository / "CHANGELOG.md", "0.1.99", "0.2.0")
    (repository / FOLDER / "0.1.99.json").rename(repository / FOLDER / "0.2.0.json")
    assert list(face_objections(repository, face)) == []
    changed(repository / "generator/linkwise/pipeline.py", "def read_system(", "def read_the_system(")
    with pytest.raises(
        LinkwiseError, match=r"^linkwise\.read_system: is told to be public, and is not there$"
    ):
        public_face(repository)


def raised(folder: Path, version: str) -> None:
    changed(folder / "generator/linkwise_runtime/version.py", f'"{VERSION}"', f'"{version}"')
    changed(folder / "CHANGELOG.md", f"## {VERSION}", f"## {version}")


def test_a_released_face_is_the_one_in_its_tag(repository: Path) -> None:
    git(repository, "tag", f"v{VERSION}")
    changed(
        repository / "generator/linkwise/package_cache.py", "def kept_package(", "def kept_package(new: int, "
    )
    with pytest.raises(LinkwiseError, match=f"version {VERSION} is tagged, and its face stays"):
        record(repository)
    face = public_face(repository)
    (repository / FOLDER / f"{VERSION}.json").write_text(written(face), encoding="utf-8")
    committed(repository)
    assert "linkwise.kept_package(new)" in " ".join(untold(repository, face))
    raised(repository, "0.2.0")
    record(repository)
    rewritten, *broken_ones = face_objections(repository, face)
    assert rewritten.startswith(f"{FOLDER}/{VERSION}.json: is not the face that v{VERSION} has")
    assert any(line.startswith("linkwise.kept_package(new)") for line in broken_ones), broken_ones


@pytest.mark.parametrize(
    "told",
    [
        "### Nothing breaking\n\n- All.",
        "### Non-breaking\n\n- All.",
        "#### Breaking\n\n- All.",
        "### Breaking\n\n### New\n\n- All.",
    ],
)
def test_only_a_heading_of_towncriers_kind_tells_that_something_breaks(told: str, repository: Path) -> None:
    changelog = repository / "CHANGELOG.md"
    changelog.write_text(f"# Changes\n\n## {VERSION}\n\n{told}\n", encoding="utf-8")
    assert not is_breaking_told(repository, VERSION)
    [kind] = {
        each["name"]
        for each in tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["towncrier"][
            "type"
        ]
        if each["directory"] == "breaking"
    }
    changelog.write_text(f"# Changes\n\n## {VERSION}\n\n### {kind}\n\n- All.\n", encoding="utf-8")
    assert is_breaking_told(repository, VERSION)
    tagged(repository)
    assert not is_breaking_told(repository, VERSION), "what is released tells nothing of later changes"


@pytest.mark.parametrize(
    ("name", "text", "is_told"),
    [
        ("41.breaking.md", "`weight` is gone.", True),
        ("41.breaking.md", " \n", False),
        ("41.unbreaking.md", "Whole again.", False),
        (".breaking.md", "Of nothing.", False),
    ],
)
def test_only_a_fragment_with_words_tells_that_something_breaks(
    name: str, text: str, is_told: bool, repository: Path
) -> None:
    (repository / "changes").mkdir(exist_ok=True)
    (repository / "changes" / name).write_text(text, encoding="utf-8")
    assert is_breaking_told(repository, VERSION) == is_told


def test_a_default_that_a_constant_holds_is_in_the_face(repository: Path) -> None:
    changed(repository / "generator/linkwise/analysis/loads/__init__.py", 'WORLD = "world"', 'WORLD = "all"')
    assert untold(repository, public_face(repository)) == [
        "linkwise.Load.__init__(axes): parameter default was changed"
    ]


def test_choices_of_flags_and_flags_of_the_program_are_in_the_face(repository: Path) -> None:
    face = public_face(repository)
    text = written(face)
    assert broken(text, face) == []
    assert broken(text.replace('"--kind=both"', '"--kind=neither"'), face) == [
        "commands.motion(--kind=neither): parameter was removed"
    ]
    assert broken(text.replace('"--base=fixed"', '"--base=hung"', 1), face) == [
        "commands.generate(--base=hung): parameter was removed"
    ]
    assert broken(text.replace('"--cmake-dir"', '"--bazel-dir"'), face) == [
        "commands.linkwise(--bazel-dir): parameter was removed"
    ]


def test_a_version_before_a_release_is_refused_in_a_line(repository: Path) -> None:
    raised(repository, "1.0.0rc1")
    committed(repository)
    for module in ("release", "release.recorded_faces"):
        done = subprocess.run(
            [sys.executable, "-m", module], cwd=repository, capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        *_, line = done.stderr.splitlines()
        assert "version 1.0.0rc1: versions of releases are numbers with points" in line
        assert "Traceback" not in done.stderr


def test_no_change_breaks_users_untold() -> None:
    mend = "tell it in changes/NAME.breaking.md; before the first release, run make api instead"
    assert untold(ROOT, public_face(ROOT)) == [], mend
