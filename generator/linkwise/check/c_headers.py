"""Checks of the headers of a package's C, bodies of functions aside, against the manifest."""

import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from linkwise.check.compare import IndexRows
from linkwise.check.compiled_c import CompiledPackage, Prototype, declarations
from linkwise.escape import identifiers
from linkwise.package.manifest import Manifest

LIMITS = {"lower": -math.inf, "upper": math.inf, "velocity": math.inf, "effort": math.inf}
"""Arrays of the joints' limits, and the value that stands for no limit."""


def wrong_header(
    manifest: Manifest,
    compiled: CompiledPackage,
    directory: Path,
    rows: IndexRows,
    functions: Iterable[Prototype],
) -> str:
    """Return the first number, index, name, limit or function unlike the manifest's; empty if none."""
    return (
        _wrong_number(manifest, compiled, rows)
        or _wrong_table(manifest, directory, rows)
        or _wrong_joint(manifest, compiled.header)
        or _wrong_function(manifest.name, compiled.header, functions)
    )


def _wrong_number(manifest: Manifest, compiled: CompiledPackage, rows: IndexRows) -> str:
    sizes = {what.upper(): len(rows.of(what)) for what in ("c2", "c1", "g", "h1")}
    expected = {"JOINTS": len(manifest.joints), "LINKS": len(manifest.links), "BLOCK": 8, "BLOCKF": 16}
    expected |= {key: size for key, size in sizes.items() if size or key != "H1"}
    expected |= {"PARAMETERS": len(manifest.parameters)} if manifest.parameters else {}
    if manifest.tree is not None:
        names = [frame.name for frame in manifest.tree.frames]
        numbers = {key: f for f, key in enumerate(identifiers(names, "FRAME_"))}
        expected |= {"FRAMES": len(names)} | numbers
    wrong = sorted(set(expected.items()) ^ set(compiled.constants.items()))
    return f"{wrong[0][0]} is wrong" if wrong else ""


def _wrong_table(manifest: Manifest, directory: Path, rows: IndexRows) -> str:
    text = (directory / "c" / f"{manifest.name}_index.h").read_text(encoding="utf-8")
    name = re.escape(manifest.name)
    for what in ("c2", "c1", "g", "h1"):
        size = f"{name.upper()}_{what.upper()}"
        head = rf"static const short {name}_{what}_index\[{size}\]\[{rows.of(what).shape[1]}\]"
        body = re.search(rf"^{head} = \{{(.*?)\n\}};", text, re.DOTALL | re.MULTILINE)
        expected, written = rows.of(what) + 1, body[1] if body else ""
        row = r"\{" + ", ".join([r"[1-9]\d*"] * expected.shape[1]) + r"\}"
        numbers = re.sub(r"[{}]", "", ",".join(re.findall(row, written)))
        listed = np.fromstring(numbers, dtype=int, sep=",")
        if re.sub(row, "", written).strip(" ,\n") or not np.array_equal(listed, expected.ravel()):
            return f"the indices of {what} are wrong"
    return ""


def _wrong_function(name: str, header: str, functions: Iterable[Prototype]) -> str:
    expected = {f"{name}_{f.name}": f.declaration(name) for f in functions}
    found = declarations(name, header)
    wrong = [
        *(f"{function} is not declared" for function in expected.keys() - found.keys()),
        *(f"{function} is declared, and there is no such function" for function in found.keys() - expected),
        *(
            f"{function} is declared otherwise"
            for function, text in expected.items()
            if found.get(function, text) != text
        ),
    ]
    return "; ".join(sorted(wrong)[:3])


def _wrong_joint(manifest: Manifest, header: str) -> str:
    """Return what is wrong with the joints' names and limits; empty if nothing."""
    size = rf"\[{re.escape(manifest.name.upper())}_JOINTS\] = \{{(.*?)\}};"
    named = re.search(rf"\b{re.escape(manifest.name)}_joint_names{size}", header, re.DOTALL)
    names = [_decoded(text) for text in re.findall(r'"((?:[^"\\]|\\.)*)"', named[1])] if named else []
    if names != [joint.name for joint in manifest.joints]:
        return "the names of the joints are wrong"
    for what, none in LIMITS.items():
        found = re.search(rf"\b{re.escape(manifest.name)}_{what}_limit{size}", header)
        limits = [float(text.replace("HUGE_VAL", "inf")) for text in found[1].split(",")] if found else []
        given = [getattr(joint, what) for joint in manifest.joints]
        if limits != [none if limit is None else limit for limit in given]:
            return f"the {what} limits are wrong"
    return ""


def _decoded(text: str) -> str:
    """Return the text of a C string literal whose only escapes are octal ones of UTF-8."""
    plain = re.sub(r"\\([0-7]{3})", lambda found: chr(int(found[1], 8)), text)
    return plain.encode("latin-1", "replace").decode("utf-8", "replace")
