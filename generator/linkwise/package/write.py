"""Writing a package: all of it or nothing."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError


def check_target(directory: Path, robot: str) -> None:
    """Raise LinkwiseError unless a package of the robot named `robot` may be written to `directory`.

    That is so where nothing is, and where an earlier package of the same robot is and nothing else.
    """
    try:
        if not directory.exists() and not directory.is_symlink():
            return
        entries = list(directory.rglob("*"))
    except OSError as error:
        raise _unwritable(directory, error) from None
    earlier = _manifest(directory)
    listed = {"manifest.json", *earlier.get("files", {})}
    files = {
        path.relative_to(directory).as_posix()
        for path in entries
        if path.is_file() and "__pycache__" not in path.parts
    }
    if directory.is_symlink() or not directory.is_dir() or (files and not files <= listed):
        raise LinkwiseError(
            f"{directory} exists and is no generated package, or holds files of its own; choose another "
            "--out or --name"
        )
    if files and earlier.get("robot") != robot:
        raise LinkwiseError(
            f"{directory} holds the package of another robot, {earlier.get('robot')!r}; give this one a "
            "--name of its own, or remove that one"
        )


def _unwritable(place: Path, error: OSError) -> LinkwiseError:
    return LinkwiseError(f"cannot write to {place}: {error.strerror}; choose another --out or --name")


def _manifest(directory: Path) -> dict[str, Any]:
    """Return the manifest of a generated package, or an empty dictionary."""
    try:
        data = json.loads((directory / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    own = isinstance(data, dict) and isinstance(data.get("files"), dict)
    return data if own and "linkwise" in data.get("generator", {}) else {}


def write_package(files: Mapping[str, str], directory: Path) -> None:
    """Write files below `directory`, replacing an earlier package there, which a failure leaves as it was.

    Raises LinkwiseError when the place is not writable or holds something else, see `check_target`.
    """
    check_target(directory, json.loads(files["manifest.json"])["robot"])
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{directory.name[:40]}-", dir=directory.parent))
    except OSError as error:
        raise _unwritable(directory.parent, error) from None
    try:
        for path, text in files.items():
            target = staging / "new" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        if directory.exists():
            directory.rename(staging / "old")
        (staging / "new").rename(directory)
    except OSError as error:
        if (staging / "old").exists() and not directory.exists():
            (staging / "old").rename(directory)
        raise _unwritable(directory, error) from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)
