"""The checkout that a release is made of: its version, what speaks against a release, and its files."""

import io
import re
import subprocess
import tarfile
from collections.abc import Iterator
from pathlib import Path

from linkwise.errors import LinkwiseError

VERSION = "generator/linkwise_runtime/version.py"
FRAGMENTS = "changes"
"""Folder of what changed since the last release, a file each, until it is told in CHANGELOG.md."""
BREAKING = "?*.breaking.md"
"""Fragments of a change that breaks what was; those that are empty tell nothing."""
NOT_PUBLISHED = "not published yet"


def version_of(root: Path) -> str:
    """Return the version of a checkout, where it is written; raises LinkwiseError unless it is numbers."""
    [version] = re.findall(r'^VERSION = "(.+)"$', (root / VERSION).read_text(encoding="utf-8"), re.MULTILINE)
    numbers(version)
    return str(version)


def numbers(version: str) -> tuple[int, ...]:
    """Return a version's numbers, by which versions are in order; raises LinkwiseError for any other."""
    if not is_numbers(version):
        raise LinkwiseError(
            f"{VERSION}: version {version}: versions of releases are numbers with points, such as 1.2.0; "
            "set VERSION to one"
        )
    return tuple(map(int, version.split(".")))


def is_numbers(version: str) -> bool:
    """Return whether a version is numbers with points, as those of releases are."""
    return re.fullmatch(r"\d+(\.\d+)+", version) is not None


def git(root: Path, *arguments: str) -> bytes:
    """Return what git prints; raises LinkwiseError where the folder is no checkout."""
    done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode().strip().splitlines()[-1:]
        raise LinkwiseError(f"{root}: a release is made in a checkout of git, which says: {' '.join(said)}")
    return done.stdout


def tags(root: Path) -> dict[str, str]:
    """Return the tags of released versions by these; none in a folder that is no checkout."""
    if not (root / ".git").exists():
        return {}
    named = git(root, "tag", "--list", "v*").decode().split()
    return {tag[1:]: tag for tag in named if is_numbers(tag[1:])}


def tags_of_head(root: Path) -> list[str]:
    """Return the tags of the last commit."""
    return git(root, "tag", "--points-at", "HEAD").decode().split()


def is_released(root: Path, version: str) -> bool:
    """Return whether a version is tagged at another commit than the last."""
    return version in tags(root) and f"v{version}" not in tags_of_head(root)


def epoch(root: Path) -> str:
    """Return the time of the last commit, in s since 1970: that of every file of a release."""
    return git(root, "log", "-1", "--format=%ct").decode().strip()


def export(root: Path, target: Path) -> Path:
    """Return a new folder with the last commit's files: what is not committed is in no release."""
    archive = git(root, "-c", "tar.umask=0022", "archive", "--format=tar", "HEAD")
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        files.extractall(target, filter="data")
    return target


def objections(root: Path) -> Iterator[str]:
    """Yield what speaks against a release of this checkout, and how it is mended."""
    version = version_of(root)
    changed = git(root, "status", "--porcelain").decode().splitlines()
    if changed:
        more = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
        yield f"{changed[0][3:]}{more}: not committed; commit or remove it"
    if is_released(root, version):
        yield f"{VERSION}: version {version} is tagged already, at another commit; raise VERSION"
    for tag in tags_of_head(root):
        if re.match(r"v\d", tag) and tag != f"v{version}":
            yield f"{VERSION}: the last commit is tagged {tag}, and is of version {version}; remove the tag"
    told = section(root, version)
    if told is None:
        yield f"CHANGELOG.md: begins with no section of {version}; tell there what changed"
    elif not told.strip():
        yield f"CHANGELOG.md: says nothing of {version}; tell there what changed"
    elif NOT_PUBLISHED in told:
        yield f"CHANGELOG.md: says that {version} is {NOT_PUBLISHED}; remove these words"
    if waiting := fragments(root, "*.*.md"):
        names = ", ".join(waiting)
        yield f"{FRAGMENTS}/: {names} not told in CHANGELOG.md yet; run towncrier build --version {version}"


def fragments(root: Path, pattern: str) -> list[str]:
    """Return the names of change fragments."""
    return sorted(path.name for path in (root / FRAGMENTS).glob(pattern))


def section(root: Path, version: str) -> str | None:
    """Return the text of CHANGELOG.md below the heading of a version, if that is the first heading."""
    changelog = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    found = re.search(r"^## \[?([\w.]+)\]?.*\n((?:(?!## ).*\n?)*)", changelog, re.MULTILINE)
    return found[2] if found and found[1] == version else None


def is_breaking_told(root: Path, version: str) -> bool:
    """Return whether a fragment, or the changelog's section of this version, tells a change that breaks.

    A section tells it below `### Breaking`, which is what towncrier writes; one that is released tells
    nothing of later changes.
    """
    if any(
        (root / FRAGMENTS / name).read_text(encoding="utf-8").strip() for name in fragments(root, BREAKING)
    ):
        return True
    told = "" if is_released(root, version) else section(root, version) or ""
    return re.search(r"^### Breaking[ \t]*\n\s*(?!#)\S", told, re.MULTILINE) is not None
