"""Writing a package: all of it or nothing, over an earlier package of the same robot only."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.output import whole_directory
from linkwise.package.manifest import FILE


def check_target(directory: Path, robot: str) -> None:
    """Raise LinkwiseError unless a package of the robot named `robot` may be written to `directory`.

    That is so where nothing is, and where an earlier package of the same robot is and nothing else.
    """
    try:
        if not directory.exists() and not directory.is_symlink():
            return
        entries = list(directory.rglob("*"))
    except OSError as error:
        raise LinkwiseError(
            f"cannot write to {directory}: {error.strerror}; choose another --out or --name"
        ) from error
    earlier = _earlier(directory)
    listed = {FILE, *earlier.get("files", {})}
    files = {
        path.relative_to(directory).as_posix()
        for path in entries
        if path.is_file() and "__pycache__" not in path.parts
    }
    if directory.is_symlink() or not directory.is_dir() or (files and not files <= listed):
        raise LinkwiseError(
            f"{directory} exists and is not a generated package, or holds files of its own; choose another "
            "--out or --name"
        )
    if files and earlier.get("robot") != robot:
        raise LinkwiseError(
            f"{directory} holds the package of another robot, {earlier.get('robot')!r}; give this one a "
            "--name of its own, or remove that one"
        )


def _earlier(directory: Path) -> dict[str, Any]:
    """Return what the manifest of a generated package of any version says, or an empty dictionary."""
    try:
        data = json.loads((directory / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    own = isinstance(data, dict) and isinstance(data.get("files"), dict)
    return data if own and "linkwise" in (data.get("generator") or {}) else {}


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
