"""Paths of a study: files beside it, or addresses, s3://bucket/walk.mot, that fsspec reads.

Of what fsspec knows, only stores that hand out bytes are asked: others open files of this machine, hand an
address on to another kind, or run what a file says.
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

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.input_file import require_file
from linkwise.output import passing_folder
from linkwise.robot.readers.bounded import too_large

STORES = ("s3", "s3a", "gs", "gcs", "az", "abfs", "abfss", "oss", "http", "https")
"""Kinds of addresses that are read."""
LOCAL = "file://"
UNSAID = 1 << 30
"""Bytes that are fetched at most of a file of which the store does not say how many there are."""
CHAINED = "::"
"""Between addresses of which fsspec opens one inside the other."""
MISSING = (HTTPStatus.NOT_FOUND, HTTPStatus.GONE)
"""How a server says that it has no such file."""
INSTEAD = "another --out, or remove it"
"""What to give where something is in the place of a study's own file."""
STARS = re.compile(r"\*[^/]*\*")
"""From the first to the last in one part of a path."""
LARGEST = 64 << 20
"""Bytes of the largest file that is read back as a whole; a trial has some hundreds in it."""


def is_address(path: str) -> bool:
    """Whether a path is one that fsspec reads, and not of this machine's disks."""
    return "://" in path


def resolved(path: str, folder: Path) -> str:
    """An address itself; of other paths, file:// before them or not, those from a folder on.

    Raises LinkwiseError for an address inside another that names its first kind alone, `reference::log.csv`,
    unless a file is called so.
    """
    whole = placed(path, folder)
    if CHAINED in path and not is_address(whole) and not os.path.lexists(whole):
        _refuse(path)
    return whole


def placed(path: str, folder: Path) -> str:
    """The same of a path with a pattern in it, which no file is called."""
    path = path.removeprefix(LOCAL)
    return path if is_address(path) else (folder / path).as_posix()


def found_by_pattern(parts: Sequence[str]) -> list[str]:
    """Files by the parts of their paths between which anything may stand, sorted; of a store perhaps more.

    fsspec looks by a regular expression, which takes for ever for a dozen stars, and takes two beside each
    other for something else: it is asked for one star in each part of the path, which finds all of it.
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
    # Not `isfile`, which says no for whatever keeps the store from answering, too.
    if _asked(path, lambda: files.info(name))["type"] != "file":
        raise LinkwiseError(f"{path}: no such file")


def version_of(path: str) -> str:
    """What changes when a file does, cheap to ask for."""
    if not is_address(path):
        found = Path(path).stat()
        return f"{found.st_size} {found.st_mtime_ns} {found.st_ctime_ns} {found.st_ino}"
    files, name = _system(path)
    return str(_asked(path, lambda: files.ukey(name)))


@contextmanager
def opened_here(path: str, most_of_robot: int | None = None) -> Iterator[Path]:
    """The file itself, or a copy that goes when the work is done.

    most_of_robot: bytes that are fetched at most, of what describes a robot
    Raises LinkwiseError where there is none; what is raised of the copy is told of the address, which is all
    that anybody can look at afterwards.
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
    """What is told of a file's copy, as told of the file: no text of a user's names the copy's folder."""
    return text.replace(str(copy), path)


def copied_here(address: str, copy: Path, most_of_robot: int | None = None) -> None:
    """Fetch a file; raises LinkwiseError, with the address, where that fails, and where too much comes.

    That is more than the store says there is, or than a robot's description may have: a server may send
    without an end, and fill the disk.
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
        hold(None, copy.stat().st_size)  # some stores call nothing back

    _asked(address, fetch)


def beside(address: str, name: str) -> str:
    """The address of a file by its path from the folder of another."""
    return f"{address.rpartition('/')[0]}/{name}"


def require_own(path: Path) -> None:
    """Raise LinkwiseError, with the path, for what is no regular file where a study has one of its own."""
    with within(str(path)):
        require_file(path, wanted=INSTEAD)


def read_back(path: Path) -> str:
    """Text of a file that a study wrote into its own folder; raises UnicodeDecodeError for what is none.

    Raises LinkwiseError, with the path, for what is no regular file by now, or far too large a one.
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
    """Take away a folder and all in it, if it is there."""
    shutil.rmtree(folder, ignore_errors=True)


def _system(path: str) -> tuple[Any, str]:
    """What serves an address, and its path there; raises LinkwiseError for kinds that are not read."""
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
    """What a file system answers; its failures are told with the path."""
    try:
        return question()
    except Exception as error:  # of whatever library serves it
        raise LinkwiseError(f"{path}: {_reason(error)}") from error


def _reason(error: BaseException) -> str:
    """What an error of a file system says, in words."""
    if isinstance(error, FileNotFoundError):
        # Of HTTP that is said for every failure, which is then the cause.
        if error.__cause__ is None or getattr(error.__cause__, "status", None) in MISSING:
            return "no such file"
        error = error.__cause__
    said = str(error) or type(error).__name__
    number = (isinstance(error, OSError) and error.errno) or 0
    return f"{os.strerror(number)}: {said}" if number in errno.errorcode else said
