"""Paths of a study: files beside it, or addresses such as s3://bucket/walk.mot that fsspec reads.

Of the kinds that fsspec knows, only stores that return bytes are asked: others open files of this machine,
pass an address on to another kind, or run what a file says.
"""

import errno
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from glob import escape, glob
from http import HTTPStatus
from pathlib import Path
from typing import Any, NoReturn

from linkwise.bounded_file import too_large
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.input_file import require_file
from linkwise.output import passing_folder

STORES = ("s3", "s3a", "gs", "gcs", "az", "abfs", "abfss", "oss", "http", "https")
"""Kinds of addresses that are read."""
LOCAL = "file://"
UNSAID = 1 << 30
"""Most bytes that are fetched of a file whose size the store does not say."""
CHAINED = "::"
"""Separator of addresses of which fsspec opens one inside the other."""
MISSING = (HTTPStatus.NOT_FOUND, HTTPStatus.GONE)
"""Statuses by which a server says that it has no such file."""
INSTEAD = "another --out, or remove it"
"""Advice where something is in the place of a study's own file."""
STARS = re.compile(r"\*[^/]*\*")
"""Stars in one part of a path, from the first to the last."""
LARGEST = 64 << 20
"""Most bytes of a file that is read back as a whole; a trial's has some hundreds."""


def is_address(path: str) -> bool:
    """Return whether a path is an address that fsspec reads, and not on this machine's disks."""
    return "://" in path


def resolved(path: str, folder: Path) -> str:
    """Return an address itself; else the path from a folder on, with file:// removed.

    Raises LinkwiseError for an address inside another that names its first kind alone, `reference::log.csv`,
    unless a file has that name.
    """
    whole = placed(path, folder)
    if CHAINED in path and not is_address(whole) and not os.path.lexists(whole):
        _refuse(path)
    return whole


def placed(path: str, folder: Path) -> str:
    """Return an address itself; else the path from a folder on, unchecked, as it may have a pattern."""
    path = path.removeprefix(LOCAL)
    return path if is_address(path) else (folder / path).as_posix()


def found_by_pattern(parts: Sequence[str]) -> list[str]:
    """Return the files whose paths have these parts with anything between, sorted; of a store perhaps more.

    fsspec matches by a regular expression, which takes forever for a dozen stars, and gives two adjacent
    stars another meaning: it is asked for one star in each part of the path, which finds all files.
    """
    if not is_address(parts[0]):
        return sorted(glob("*".join(map(escape, parts))))
    files, path = _system(STARS.sub("*", "*".join(parts)))
    return sorted(files.unstrip_protocol(name) for name in _asked(path, lambda: files.glob(path)))


def require_there(path: str, or_folder: bool = False) -> None:
    """Raise LinkwiseError, with the path, for what is not a file, nor a folder where one may be."""
    if not is_address(path):
        if or_folder and Path(path).is_dir():
            return
        try:
            require_file(Path(path))
        except LinkwiseError as error:
            raise LinkwiseError(f"{path}: {error}") from error
        return
    files, name = _system(path)
    # Not `isfile`, which is also False for anything that keeps the store from answering.
    if _asked(path, lambda: files.info(name))["type"] != "file":
        raise LinkwiseError(f"{path}: no such file")


def version_of(path: str) -> str:
    """Return a text that changes when a file does, and is cheap to get."""
    if not is_address(path):
        found = Path(path).stat()
        return f"{found.st_size} {found.st_mtime_ns} {found.st_ctime_ns} {found.st_ino}"
    files, name = _system(path)
    return str(_asked(path, lambda: files.ukey(name)))


@contextmanager
def opened_here(path: str, most_of_robot: int | None = None) -> Iterator[Path]:
    """Give the file itself, or a copy that is removed when the work is done.

    most_of_robot: most bytes that are fetched, for a robot's description
    Raises LinkwiseError where there is no file; errors about the copy name the address instead, which is all
    that a user can look at afterwards.
    """
    if not is_address(path):
        yield Path(path)
        return
    name = path.rpartition("/")[2]
    if name in ("", ".", ".."):
        raise LinkwiseError(f"{path}: an address of a folder; give one of a file")
    with passing_folder() as folder:
        copy = folder / name
        copied_here(path, copy, most_of_robot)
        try:
            yield copy
        except LinkwiseError as error:
            raise LinkwiseError(told_of(path, copy, str(error))) from error


def told_of(path: str, copy: Path, text: str) -> str:
    """Return a message about a file's copy as one about the file; no user's text names the copy's folder."""
    return text.replace(str(copy), path)


def copied_here(address: str, copy: Path, most_of_robot: int | None = None) -> None:
    """Fetch a file; raise LinkwiseError, with the address, where that fails, and where too much arrives.

    Too much is more than the store announces, or than a robot's description may have: a server may send
    without end, and fill the disk.
    """
    files, name = _system(address)
    copy.parent.mkdir(parents=True, exist_ok=True)

    def fetch() -> None:
        said = files.info(name).get("size")

        def hold(size: int | None, fetched: int, **_: object) -> None:
            if most_of_robot is not None and max(fetched, said or 0) > most_of_robot:
                raise too_large(most_of_robot)
            most = max(UNSAID if said is None else said, size or 0)
            if fetched > most:
                beyond = f"{most:,} bytes" + ("" if said is None else ", as the store says it has")
                raise LinkwiseError(f"more comes than {beyond}; fetch it yourself, and name your copy")

        hold(None, 0)
        callback = extra("fsspec.callbacks").Callback(hooks={"bound": hold})  # after each part
        files.get_file(name, str(copy), callback=callback)
        hold(None, copy.stat().st_size)  # some stores call no callback

    _asked(address, fetch)


def beside(address: str, name: str) -> str:
    """Return the address of a file by its path from the folder of another address."""
    return f"{address.rpartition('/')[0]}/{name}"


def require_own(path: Path) -> None:
    """Raise LinkwiseError, with the path, where a study's own file is not a regular file."""
    with within(str(path)):
        require_file(path, wanted=INSTEAD)


def read_back(path: Path) -> str:
    """Return the text of a file that a study wrote into its own folder.

    Raises UnicodeDecodeError for what is not text, and LinkwiseError, with the path, for what is no longer a
    regular file, or far too large.
    """
    require_own(path)
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise LinkwiseError(
            f"{path}: the file is larger than {LARGEST >> 20} MiB, which none of a study's is; give {INSTEAD}"
        )
    return data.decode()


def removed(folder: Path) -> None:
    """Remove a folder and all in it, if it is there."""
    shutil.rmtree(folder, ignore_errors=True)


def _system(path: str) -> tuple[Any, str]:
    """Return the file system of an address, and its path there; raise LinkwiseError for unsupported kinds."""
    if path.partition("://")[0] not in STORES or CHAINED in path:
        _refuse(path)
    try:
        files, name = extra("fsspec.core").url_to_fs(path)
    except (ImportError, ValueError) as error:
        raise LinkwiseError(f"{path}: {error}") from error
    return files, name


def _refuse(path: str) -> NoReturn:
    raise LinkwiseError(
        f"{path}: give a file, or an address of {listed(STORES, len(STORES))} without {CHAINED!r}; others"
        " are not read, as they may run or open what they name"
    )


def _asked(path: str, question: Any) -> Any:
    """Return the answer of a file system; raise its failures as LinkwiseError with the path."""
    try:
        return question()
    except Exception as error:  # from whatever library serves it
        raise LinkwiseError(f"{path}: {_reason(error)}") from error


def _reason(error: BaseException) -> str:
    """Return what an error of a file system says, in words."""
    if isinstance(error, FileNotFoundError):
        # Over HTTP every failure raises this; the real one is then its cause.
        if error.__cause__ is None or getattr(error.__cause__, "status", None) in MISSING:
            return "no such file"
        error = error.__cause__
    said = str(error) or type(error).__name__
    number = (isinstance(error, OSError) and error.errno) or 0
    return f"{os.strerror(number)}: {said}" if number in errno.errorcode else said
