"""Unpacking of a bundle, every file held to its hash."""

import hashlib
import shutil
from pathlib import Path, PurePosixPath, PureWindowsPath
from zipfile import BadZipFile, ZipFile

from linkwise.bounded_file import MIB
from linkwise.bundle.contents import CONTENTS, RESULT, Bundle, PackedFile, kind_of
from linkwise.bundle.references import beside_of, is_within
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.input_file import require_file
from linkwise.robot import Options, robot_files

CHUNK = MIB
FOLDERS = (("log",), ("robot",), ("files",), (RESULT,))
"""Folders of a bundle; a file beside them might be taken for a built-in robot."""
DAMAGES = (
    *(BadZipFile, EOFError, KeyError, NotImplementedError),
    *(OSError, OverflowError, RuntimeError, ValueError),
)
"""Errors that zipfile and JSON raise for what is none of theirs."""
MOST = 16 * MIB
"""Most bytes of a bundle's own record."""


def unpacked(file: Path, folder: Path) -> Bundle:
    """Write the files of a bundle into a folder, and return its contents, with names below that folder.

    Raises LinkwiseError, which names the file, for what is no bundle, is damaged, would not fit, asks for
    options that are not known here, or names files that are not in it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with within(str(file)):
        require_file(file, wanted="a bundle that `linkwise analyze --bundle` wrote")
        try:
            with ZipFile(file) as archive:
                bundle = _contents(archive)
                bundle.require_own()
                _require_room(bundle, folder)
                for name, told in bundle.files.items():
                    _write(archive, name, told, folder)
        except LinkwiseError:
            raise
        except DAMAGES as error:
            said = short(str(error.args[0]) if error.args else type(error).__name__, 200)
            raise LinkwiseError(f"is no bundle, or a damaged one: {said}") from error
        _require_alone(bundle, folder)
    return bundle


def _require_alone(bundle: Bundle, folder: Path) -> None:
    """Raise LinkwiseError where a robot is not what is said of it, or files name others outside."""
    asked = bundle.analysis
    there = [(folder / path, beside_of(folder / path)) for path in asked.files]
    if asked.kind != "built-in":
        robot = folder / asked.robot
        if kind_of(robot) != asked.kind:
            raise LinkwiseError(f"says that its robot is a {asked.kind}, which is not so; do not trust it")
        if asked.kind == "file":
            there.append((robot, list(robot_files(robot, Options()))))
    for path, beside in there:
        if not is_within(beside, folder):
            name = path.relative_to(folder).as_posix()
            raise LinkwiseError(f"its {name} names files that are not in it; do not trust it")


def _contents(archive: ZipFile) -> Bundle:
    with archive.open(CONTENTS) as content:
        text = content.read(MOST + 1)
    if len(text) > MOST:
        raise LinkwiseError(f"its {CONTENTS} is larger than {MOST // MIB} MiB, which none is")
    return Bundle.read(text.decode())


def _require_room(bundle: Bundle, folder: Path) -> None:
    size, free = sum(told.bytes for told in bundle.files.values()), shutil.disk_usage(folder).free
    if size > free:
        raise LinkwiseError(
            f"takes {size / MIB:,.0f} MiB unpacked, and {folder} has {free / MIB:,.0f} MiB left"
        )


def _write(archive: ZipFile, name: str, told: PackedFile, folder: Path) -> None:
    parts = PurePosixPath(name).parts
    if (
        parts[:1] not in FOLDERS
        or ".." in parts
        or name.startswith("/")
        or PureWindowsPath(name).anchor
        or "\\" in name
    ):
        raise LinkwiseError(f"has a file {short(name, 80)!a}, outside of its folders; do not trust it")
    target, digest, size = folder / name, hashlib.sha256(), 0
    target.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(name) as packed, target.open("wb") as out:
        while chunk := packed.read(CHUNK):
            size += len(chunk)
            if size > told.bytes:
                break
            digest.update(chunk)
            out.write(chunk)
    if size != told.bytes or digest.hexdigest() != told.sha256:
        raise LinkwiseError(f"its file {short(name, 80)!a} is not what was packed: the bundle was changed")
