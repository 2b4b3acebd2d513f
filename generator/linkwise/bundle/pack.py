"""Packing of an analysis into one file."""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from linkwise.bundle.contents import CONTENTS, RESULT, Bundle, PackedFile, WrittenAnalysis, versions_here
from linkwise.bundle.references import beside_of, is_within
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, listed
from linkwise.option import chosen
from linkwise.pipeline import read_system
from linkwise.robot import Options, robot_files

CHUNK = 1 << 20
BEGIN = (1980, 1, 1, 0, 0, 0)
"""Time of each file in a bundle: the same content is the same bytes."""
UNREAD = ("__pycache__",)


@dataclass(frozen=True)
class BundledPart:
    """Files or folders that go along for one path of an analysis, below a folder of the bundle."""

    name: str
    path: str
    files: tuple[Path, ...]


@dataclass(frozen=True)
class BundledInputs:
    """Files of an analysis that go into its bundle, and the names of those that are left out."""

    analysis: WrittenAnalysis
    parts: tuple[BundledPart, ...]
    left_out: tuple[str, ...] = ()

    @staticmethod
    def of(analysis: WrittenAnalysis) -> "BundledInputs":
        """Return the files of an analysis that is written with paths of this machine.

        Raises LinkwiseError for files that name others by paths of this machine.
        """
        parts = [BundledPart("log", analysis.log, (Path(analysis.log),))]
        for number, path in enumerate(dict.fromkeys(analysis.files)):
            beside = beside_of(Path(path))
            _require_relative(Path(path), beside)
            parts.append(BundledPart(f"files/{number}", path, (Path(path), *beside)))
        kept, left_out = _robot_files(analysis)
        if kept:
            parts.append(BundledPart("robot", analysis.robot, kept))
        return BundledInputs(analysis, tuple(parts), left_out)


def pack(inputs: BundledInputs, result: Sequence[Path], to: Path) -> Bundle:
    """Write a bundle of an analysis and return what it holds; result: files of the result that go along."""
    with ZipFile(to, "w", ZIP_DEFLATED) as archive:
        packed = _Packed(archive)
        for part in inputs.parts:
            packed.add(part)
        for file in result:
            packed.write(f"{RESULT}/{file.name}", file)
        told = inputs.analysis.with_files(packed.named)
        bundle = Bundle(told, versions_here(), packed.files, inputs.left_out)
        with archive.open(ZipInfo(CONTENTS, BEGIN), "w") as record:
            record.write(json_text(bundle.record(), indent=1).encode())
    return bundle


@dataclass
class _Packed:
    """The files of a bundle that is being written, and the names in it of paths of this machine."""

    archive: ZipFile
    files: dict[str, PackedFile] = field(default_factory=dict)
    named: dict[str, str] = field(default_factory=dict)

    def add(self, part: BundledPart) -> None:
        """Add files, or all that is in folders, as they lie to each other."""
        root = _root(part.files)
        for file in dict.fromkeys(one for path in part.files for one in _inside(path)):
            self.write(f"{part.name}/{_below(file, root)}", file)
        self.named[part.path] = f"{part.name}/{_below(Path(part.path), root)}"

    def write(self, name: str, file: Path) -> None:
        """Add a file under a name."""
        info, digest = ZipInfo(name, BEGIN), hashlib.sha256()
        info.compress_type = ZIP_DEFLATED
        size = file.stat().st_size
        info.file_size = size  # zipfile needs it beforehand to make room for large ones
        with file.open("rb") as content, self.archive.open(info, "w") as packed:
            while chunk := content.read(CHUNK):
                digest.update(chunk)
                packed.write(chunk)
        self.files[name] = PackedFile(size, digest.hexdigest())


def _robot_files(analysis: WrittenAnalysis) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Return the robot's files, none of a built-in one, and the names of those that are left out."""
    robot = Path(analysis.robot)
    if analysis.kind != "file":
        return (() if analysis.kind == "built-in" else (robot,)), ()
    with tempfile.TemporaryDirectory() as folder:
        options = chosen(Options, {**analysis.options, "constraints": None})
        files = robot_files(robot, options)
        kept = tuple(file for file in files if not _is_mesh(file))
        if len(kept) < len(files) and not _is_readable(robot, kept, analysis, Path(folder) / "bare"):
            kept = files
        copy = _copied(robot, kept, Path(folder) / "whole")
        if not is_within(robot_files(copy, options), Path(folder)):
            raise LinkwiseError(
                f"--bundle: {robot} names files by paths of this machine; name them relative to it"
            )
    return kept, tuple(file.name for file in files if file not in kept)


MESHES = (
    ".stl",
    ".obj",
    ".dae",
    ".msh",
    ".ply",
    ".vtp",
    ".gltf",
    ".glb",
    ".skn",
    ".png",
    ".jpg",
    ".jpeg",
    ".ktx",
)
"""Endings of files of shapes and pictures."""


def _is_mesh(file: Path) -> bool:
    return file.suffix.lower() in MESHES


def _is_readable(robot: Path, files: Sequence[Path], analysis: WrittenAnalysis, folder: Path) -> bool:
    """Return whether a robot is read without its other files: masses may be those of meshes."""
    try:
        read_system(_copied(robot, files, folder), chosen(Options, analysis.options))
    except LinkwiseError:
        return False
    return True


def _copied(robot: Path, files: Sequence[Path], folder: Path) -> Path:
    """Copy files as they lie to each other, and return the copy of the robot's own."""
    root = _root(files)
    for file in files:
        target = folder / _below(file, root)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, target)
    return folder / _below(robot, root)


def _require_relative(path: Path, beside: Sequence[Path]) -> None:
    """Raise LinkwiseError unless a copy of `path` finds copies of the files beside it."""
    if not beside:
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = _copied(path, [path, *beside], Path(folder))
        if not is_within(beside_of(copy), Path(folder)):
            raise LinkwiseError(
                f"--bundle: {path} names {listed(beside)} by paths of this machine; name them relative to it"
            )


def _inside(path: Path) -> Iterator[Path]:
    """Yield the file itself; of a folder all files in it but what Python makes anew."""
    if path.is_dir():
        for file in sorted(path.rglob("*")):
            if file.is_file() and not set(UNREAD) & set(file.parts):
                yield file
    else:
        yield path


def _root(files: Sequence[Path]) -> Path:
    """Return the folder in which all files lie."""
    return Path(os.path.commonpath([os.path.abspath(file.parent) for file in files]))


def _below(file: Path, root: Path) -> str:
    return Path(os.path.abspath(file)).relative_to(root).as_posix()
