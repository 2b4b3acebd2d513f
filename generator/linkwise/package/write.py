"""Writing a package: all of it or nothing, over an earlier package of the same robot only."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.output import whole_directory
from linkwise.package.contents import added
from linkwise.package.manifest import FILE


def check_target(directory: Path, robot: str) -> None:
    """Raise LinkwiseError unless a package of the robot named `robot` may be written to `directory`.

    That is so where nothing is, and where an earlier package of the same robot is and nothing else; in no
    case inside another package.
    """
    refuse_inside_package(directory.parent)
    if not os.path.lexists(directory):
        return
    if directory.is_symlink() or not directory.is_dir():
        what = "a symbolic link" if directory.is_symlink() else "not a folder"
        raise LinkwiseError(f"{directory} is {what}; choose another --out or --name")
    earlier = earlier_package(directory)
    try:
        foreign = not earlier and next(directory.iterdir(), None) is not None
        own = added(directory, earlier.get("files", {}))
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
    if earlier and earlier.get("robot") != robot:
        raise LinkwiseError(
            f"{directory} holds the package of another robot, {ascii(earlier.get('robot'))[:80]}; give this "
            "one a --name of its own, or remove that one"
        )


def refuse_inside_package(place: Path) -> None:
    """Raise LinkwiseError for a generated package, or a place inside one: what is written there spoils it."""
    here = Path(os.path.realpath(place))
    for parent in (here, *here.parents):
        if earlier_package(parent):
            raise LinkwiseError(
                f"{place} is in the generated package {parent}, which it would spoil; choose another --out"
            )


def earlier_package(directory: Path) -> dict[str, Any]:
    """What the manifest of a generated package of any version says, or an empty dictionary."""
    path = directory / FILE
    try:
        data = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(data, dict):
        return {}
    generator = data.get("generator")
    own = isinstance(data.get("files"), dict) and isinstance(generator, dict) and "linkwise" in generator
    return data if own else {}


def write_package(files: Mapping[str, str], directory: Path) -> None:
    """Write files below `directory`, replacing an earlier package there, which a failure leaves as it was.

    Raises LinkwiseError when the place is not writable or holds something else, see `check_target`.
    """
    robot = json.loads(files[FILE])["robot"]
    with whole_directory(directory, lambda target: check_target(target, robot)) as draft:
        for path, text in files.items():
            target = draft / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
