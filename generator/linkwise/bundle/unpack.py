"""Unpacking of a bundle, every file held to its hash."""

import hashlib
import shutil
from pathlib import Path, PurePosixPath, PureWindowsPath
from zipfile import BadZipFile, ZipFile

from linkwise.bounded_file import MIB
from linkwise.bundle.contents import CONTENTS, Bundle, PackedFile
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.input_file import require_file

CHUNK = MIB
MOST = 16 * MIB
"""Most bytes of a bundle's own record."""


def unpacked(file: Path, folder: Path) -> Bundle:
    """Write the files of a bundle into a folder, and return its contents, with names below that folder.

    Raises LinkwiseError, which names the file, for what is no bundle, is damaged, or would not fit.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with within(str(file)):
        require_file(file, wanted="a bundle that `linkwise analyze --bundle` wrote")
        try:
            with ZipFile(file) as archive:
                bundle = _contents(archive)
                _require_room(bundle, folder)
                for name, told in bundle.files.items():
                    _write(archive, name, told, folder)
        except (
            BadZipFile,
            EOFError,
            KeyError,
            NotImplementedError,
            OSError,
            RuntimeError,
            ValueError,
        ) as error:
            if isinstance(error, LinkwiseError):
                raise
            raise LinkwiseError(f"is no bundle, or a damaged one: {short(str(error), 200)}") from error
    return bundle


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
    if not parts or ".." in parts or name.startswith("/") or PureWindowsPath(name).anchor or "\\" in name:
        raise LinkwiseError(
            f"has a file {short(name, 80)!a}, outside of any folder of its own; do not trust it"
        )
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
