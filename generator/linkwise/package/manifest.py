"""A package's manifest, read and checked entry by entry."""

import json
import math
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError


def read_manifest(directory: Path) -> dict[str, Any]:
    """Return a package's manifest; raises LinkwiseError when there is none, or a damaged one."""
    path = directory / "manifest.json"
    if not path.is_file():
        raise LinkwiseError(f"{directory} holds no manifest.json; give the directory of a generated package")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LinkwiseError(f"{path} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise LinkwiseError(f"{path} is no JSON ({error}); generate the package again") from None
    if not isinstance(data, dict) or data.get("schema") != 1:
        raise LinkwiseError(f"{path} has another schema; generate the package again")
    fault = _fault(data)
    if fault:
        raise LinkwiseError(f"{path} is damaged: {fault}; generate the package again")
    return data


def _fault(data: dict[str, Any]) -> str:
    """Return which entry is missing or of a wrong kind, or an empty string."""
    kinds = {"files": dict, "request": dict, "conventions": dict, "joints": list, "links": list}
    for key, kind in kinds.items():
        if not isinstance(data.get(key), kind):
            return f"{key!r} is no {'list' if kind is list else 'object'}"
    count = len(data["joints"])
    if not count or not all(isinstance(_get(joint, "name"), str) for joint in data["joints"]):
        return "'joints' must be a list of objects with a name"
    for link in data["links"]:
        if not isinstance(_get(link, "name"), str) or not _indices(_get(link, "path"), count):
            return "'links' must be a list of objects with a name and a path of joints"
    if "skeleton" not in data:
        return "'skeleton' is missing"
    return _skeleton_fault(data, count) if data["skeleton"] is not None else ""


def _skeleton_fault(data: dict[str, Any], count: int) -> str:
    if not _array(data["conventions"].get("gravity"), 3):
        return "'conventions' has no gravity of three numbers"
    if not isinstance(data["skeleton"], list):
        return "'skeleton' is no list"
    for number, body in enumerate(data["skeleton"]):
        for key, shape in (("rotation", (3, 3)), ("inertia", (3, 3)), ("translation", (3,)), ("com", (3,))):
            if not _array(_get(body, key), *shape):
                return f"{key!r} of body {number} of the skeleton is no array of {3 ** len(shape)} numbers"
        for key in ("mass", "ratio"):
            if not _array(body.get(key)):
                return f"{key!r} of body {number} of the skeleton is no number"
        if not _indices([body.get("coordinate")], count) or body.get("kind") not in (
            "revolute",
            "prismatic",
        ):
            return f"body {number} of the skeleton hangs on no joint"
        if "parent" not in body or (body["parent"] is not None and not _indices([body["parent"]], number)):
            return f"'parent' of body {number} of the skeleton is no earlier body"
    bodies = [body.get("link") for body in data["skeleton"]]
    lost = [link["name"] for link in data["links"] if link["name"] not in bodies]
    return f"link {lost[0]!r} is not in the skeleton" if lost else ""


def _get(item: Any, key: str) -> Any:
    return item.get(key) if isinstance(item, dict) else None


def _indices(items: Any, count: int) -> bool:
    return isinstance(items, list) and all(type(item) is int and 0 <= item < count for item in items)


def _array(item: Any, *shape: int) -> bool:
    """Whether an entry is a list of lists of finite numbers of this shape; of none, one number."""
    if shape:
        return isinstance(item, list) and len(item) == shape[0] and all(_array(i, *shape[1:]) for i in item)
    return isinstance(item, (int, float)) and not isinstance(item, bool) and math.isfinite(item)
