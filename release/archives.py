"""Archives of sources and wheels of both distributions, the same byte for byte whenever they are built."""

import hashlib
import os
import sys
import tarfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from linkwise.errors import LinkwiseError
from repro_tarfile import ReproducibleTarFile

from release.checkout import export
from release.command import run

PROJECTS = (".", "generator/linkwise_runtime")
"""Folders of the distributions: linkwise, and the runtime alone."""
ELSEWHERE = {"TZ": "Asia/Kathmandu", "LC_ALL": "C", "PYTHONHASHSEED": "1"}
"""Surroundings that must not matter."""


class Archives(NamedTuple):
    """An archive of sources, and the wheel that is built from it."""

    sources: Path
    wheel: Path


def built(
    project: Path, target: Path, python: Path = Path(sys.executable), environment: Mapping[str, str] = {}
) -> Archives:
    """Build the archives of a project into a folder of its own, with the tools that a Python has.

    Nothing is fetched. Raises LinkwiseError where the build fails.
    """
    path = f"{python.parent}{os.pathsep}{os.environ['PATH']}"
    build = (python, "-m", "build", "--no-isolation", "--outdir", target, project)
    run(*build, folder=project, **{"PATH": path, "PYTHONPATH": "", **environment})
    [sources], [wheel] = target.glob("*.tar.gz"), target.glob("*.whl")
    return Archives(sources, wheel)


def released(root: Path, work: Path, epoch: str, environment: Mapping[str, str]) -> list[Path]:
    """Build the archives of the last commit in a folder, with that commit's time in them."""
    tree = export(root, work / "tree")
    found: list[Path] = []
    for project in PROJECTS:
        target = work / f"archives-{len(found)}"
        archives = built(tree / project, target, environment={"SOURCE_DATE_EPOCH": epoch, **environment})
        evened(archives.sources, epoch)
        found += archives
    return found


def evened(archive: Path, epoch: str) -> None:
    """Write an archive of sources anew without the times and the owner that setuptools leaves in it."""
    before = archive.with_suffix(".before")
    archive.rename(before)
    os.environ["SOURCE_DATE_EPOCH"] = epoch
    with tarfile.open(before) as old, ReproducibleTarFile.open(archive, "w:gz") as new:
        for member in sorted(old.getmembers(), key=lambda member: member.name):
            member.pax_headers = {}  # fractions of seconds, beside the time that is evened
            new.addfile(member, old.extractfile(member))
    before.unlink()


def twice(root: Path, work: Path, target: Path, epoch: str) -> list[Path]:
    """Build everything twice, in folders and surroundings that differ, and return the files in `target`.

    Raises LinkwiseError for a file that is not the same both times.
    """
    first = released(root, work / "first", epoch, {})
    second = released(root, work / "a second", epoch, ELSEWHERE)
    for one, other in zip(first, second, strict=True):
        if one.read_bytes() != other.read_bytes():
            raise LinkwiseError(f"{one.name}: not the same bytes when it is built twice")
    return [path.replace(target / path.name) for path in first]


def checked(archives: Iterable[Path], version: str) -> None:
    """Raise LinkwiseError unless the archives are of this version, and an index would take them."""
    files = list(archives)
    for path in files:
        if f"-{version}" not in path.name:
            raise LinkwiseError(f"{path.name}: not of version {version}")
    run(sys.executable, "-m", "twine", "check", "--strict", *files, folder=files[0].parent)


def sums(folder: Path) -> str:
    """Return the SHA-256 of every file of a folder, as `sha256sum --check` reads them."""
    files = sorted(folder.iterdir())
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
