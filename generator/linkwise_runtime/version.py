"""Version of this runtime, which is also that of linkwise, and the checks of the packages that it runs."""

import hashlib
import re
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakKeyDictionary

VERSION = "0.1.0"
_IMPORTED: WeakKeyDictionary[Any, str] = WeakKeyDictionary()
"""Hashes of packages as they were imported, by their structures."""


class ImportedStructure(Protocol):
    """Structure of a robot."""

    @property
    def name(self) -> str:
        """Name of the robot."""


def require(version: str) -> None:
    """Raise ImportError unless this runtime runs packages that linkwise `version` generated.

    It runs packages of its own minor version, up to its own patch; a text that is no such version is refused.
    """
    own, asked = (_numbers(text) for text in (VERSION, version))
    is_later = own is not None and asked is not None and own[:2] == asked[:2] and own > asked
    if not (version == VERSION or is_later):
        raise ImportError(
            f"this package is made for linkwise_runtime {version}, but {VERSION} is installed: generate it "
            f"again, or install linkwise {version}, or linkwise-runtime {version} where linkwise is not"
        )


def require_as_imported(robot: ImportedStructure, file: str) -> None:
    """Raise RuntimeError where a package was generated anew since Python imported it.

    Its modules are imported one by one, as back ends are loaded: some would be of the old robot, some of the
    new one.

    robot: the package's structure, which lives as long as what was imported, also where that is reloaded;
    file: the package's `__init__.py`, beside which its manifest has the hashes of all files
    """
    now = _digest(file)
    if now and now != _IMPORTED.setdefault(robot, now):
        raise RuntimeError(
            f"{robot.name} was generated anew after it was imported; start Python again to use it"
        )


def _digest(file: str) -> str:
    """Return a hash of a package's manifest; "" where there is none, as in an archive."""
    try:
        return hashlib.sha256(Path(file).with_name("manifest.json").read_bytes()).hexdigest()
    except OSError:
        return ""


def _numbers(version: str) -> tuple[int, ...] | None:
    found = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version)
    return tuple(map(int, found.groups())) if found else None
