"""Writing of a package: all of it or nothing, over an earlier package of the same robot only.

Build tools compare times: a file whose content is unchanged keeps its time, and a package of which nothing
differs is not touched.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.output import refuse_unless_folder, require_writable, whole_directory
from linkwise.package.contents import entries, faults, unlisted_files
from linkwise.package.manifest import FILE, is_too_large


def check_target(directory: Path, robot: str | None) -> None:
    """Raise LinkwiseError unless a package of the robot named `robot` may be written to `directory`.

    It may where nothing is, and where an earlier package of the same robot is and nothing else, of any robot
    if None is given; in no case inside another package. Empty folders, which build tools make for what is to
    come, count as nothing.
    """
    refuse_inside_package(directory.parent)
    if not os.path.lexists(directory):
        return
    refuse_unless_folder(directory, "choose another --out or --name")
    earlier = earlier_package(directory)
    try:
        foreign = not earlier and next(entries(directory), None) is not None
        own = unlisted_files(directory, earlier.get("files", {}))
    except OSError as error:
        raise LinkwiseError(
            f"cannot write to {directory}: {error.strerror}; choose another --out or --name"
        ) from error
    if foreign:
        raise LinkwiseError(
            f"{directory} exists and is not a generated package; choose another --out or --name"
        )
    if own:
        raise LinkwiseError(
            f"{directory} holds {own[0][:80]!a}, which linkwise did not write; move it away, or choose "
            "another --out or --name"
        )
    if earlier and robot is not None and earlier.get("robot") != robot:
        raise LinkwiseError(
            f"{directory} holds the package of another robot, {ascii(earlier.get('robot'))[:80]}; give this "
            "one a --name of its own, remove that one, or pass --replace"
        )


def refuse_inside_package(place: Path) -> None:
    """Raise LinkwiseError for a generated package, or a place inside one, which writing there would spoil."""
    here = Path(os.path.realpath(place))
    for parent in (here, *here.parents):
        if earlier_package(parent):
            raise LinkwiseError(
                f"{place} is in the generated package {parent}, which it would spoil; choose another --out"
            )


def require_free(place: Path) -> None:
    """Raise LinkwiseError for a place inside a generated package, and for one that cannot be written."""
    refuse_inside_package(place)
    require_writable(place)


def earlier_package(directory: Path) -> dict[str, Any]:
    """Return the manifest's content of a generated package of any version, or an empty dictionary."""
    path = directory / FILE
    try:
        is_one = path.is_file() and not is_too_large(path)
        data = json.loads(path.read_text(encoding="utf-8")) if is_one else None
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(data, dict):
        return {}
    generator = data.get("generator")
    own = isinstance(data.get("files"), dict) and isinstance(generator, dict) and "linkwise" in generator
    return data if own else {}


def differences(files: Mapping[str, str], directory: Path) -> dict[str, str]:
    """Return how a package in `directory` differs from `files`, by path, in words; empty if not at all."""
    wanted = {path: hashlib.sha256(text.encode()).hexdigest() for path, text in files.items()}
    found = {
        path: fault.replace("was changed", "differs") for path, fault in faults(directory, wanted).items()
    }
    former = earlier_package(directory).get("files", {})
    gone = [path for path in former if path not in wanted and os.path.lexists(directory / path)]
    return found | dict.fromkeys(sorted(gone), "is not written any more")


def write_package(files: Mapping[str, str], directory: str | Path, replace: bool = False) -> bool:
    """Write files below `directory`, replacing an earlier package there, which a failure leaves as it was.

    With `replace` that package may be of another robot. Returns whether anything differed. Raises
    LinkwiseError when the place is not writable or holds something else, see `check_target`.
    """
    directory = Path(directory)
    robot = None if replace else json.loads(files[FILE])["robot"]
    if os.path.lexists(directory):
        check_target(directory, robot)
    differing = differences(files, directory)
    if not differing:
        return False
    with whole_directory(directory, lambda target: check_target(target, robot)) as draft:
        for path, text in files.items():
            target = draft / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(text.encode())
            if path not in differing:
                _keep_times(directory / path, target)
    return True


def _keep_times(former: Path, target: Path) -> None:
    with suppress(FileNotFoundError):  # another writer may be between its two renames
        times = former.stat()
        os.utime(target, ns=(times.st_atime_ns, times.st_mtime_ns))
