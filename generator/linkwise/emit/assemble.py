"""Everything of a generated package that is not one back end: names, loading, shared calls, manifest."""

import hashlib
import json
import keyword
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

import sympy as sp

from linkwise import runtime
from linkwise.dynamics.kernel import decomposition_cost
from linkwise.emit.backend import BackendFiles, Loading
from linkwise.emit.derivation import Derivation
from linkwise.emit.render import render
from linkwise.symbolic.system import System
from linkwise.version import VERSION

SCHEMA = 1
LONGEST_NAME = 60
LINE = 100
SHARED_RUNTIME = ("__init__.py", "dense.py", "dynamics.py", "interface.py", "quantities.py", "structure.py")
"""Files of linkwise/runtime that every package has."""
TAKEN = {"numpy", "torch", "linkwise", *sys.stdlib_module_names}


def identifier(name: str) -> str:
    """Module name made of a robot's name: letters, digits, underscores; no keyword, no module in use."""
    text = re.sub(r"[^0-9a-z_]+", "_", name.lower()).strip("_")[:LONGEST_NAME] or "robot"
    if text[0].isdigit() or keyword.iskeyword(text) or text in TAKEN:
        text = f"robot_{text}"
    return text


def shared_files(derivation: Derivation, chosen: Iterable[BackendFiles]) -> Iterator[tuple[str, str]]:
    """Files that serve every back end, and the runtime files of those `chosen`, which `load` is to know."""
    loadable = {backend: backend.loading for backend in chosen if backend.loading}
    fastest_first = sorted(loadable.items(), key=lambda item: item[1].speed)
    system, shared = derivation.system, {"version": VERSION}
    names = {
        **shared,
        "name": repr(derivation.package),
        "joints": [ascii(c.name) for c in system.coordinates],
        "units": [repr(c.unit) for c in system.coordinates],
        "links": [ascii(link.name) for link in system.links],
        "paths": [repr(system.path(j)) for j in range(len(system.links))],
        "linear": repr(tuple(sorted(derivation.linear))),
        "parameters": [(ascii(s.name), repr(float(v))) for s, v in system.parameters.items()],
    }
    init = {
        **shared,
        "package": derivation.package,
        "default": next((backend.name for backend in loadable), ""),
        "makers": [Maker.of(backend, loading) for backend, loading in loadable.items()],
        "fastest_first": [backend.name for backend, _ in fastest_first],
        "parameters": _parameter_lines(system),
    }
    yield "__init__.py", render("package/init.py.j2", init)
    yield "names.py", render("package/names.py.j2", names)
    yield "py.typed", ""
    copied = {name for backend in loadable for name in backend.runtime}
    for name in sorted(copied.union(SHARED_RUNTIME)):
        yield f"runtime/{name}", resources.files(runtime).joinpath(name).read_text(encoding="utf-8")


@dataclass(frozen=True)
class Maker:
    """A function of the package's __init__.py that makes one back end."""

    name: str
    doc: str
    imports: tuple[str, ...]
    made: str

    @classmethod
    def of(cls, backend: BackendFiles, loading: Loading) -> "Maker":
        """Its class comes from runtime/, and is the first word of the expression."""
        made = loading.made.partition("(")[0]
        imported = f"from .runtime.{loading.module} import {made}"
        return cls(backend.name, backend.doc, (*loading.imports, imported), loading.made)


def _parameter_lines(system: System) -> list[str]:
    """Names of the parameters as lines of a docstring, which none of their characters can end."""
    lines: list[str] = []
    for symbol in system.parameters:
        name = ascii(symbol.name).replace("\\", "\\\\").replace('"', '\\"')
        if lines and len(lines[-1]) + len(name) < LINE:
            lines[-1] += f" {name},"
        else:
            lines.append(f"{name},")
    return [*lines[:-1], *(last.removesuffix(",") for last in lines[-1:])]


def manifest(derivation: Derivation, files: Mapping[str, str]) -> str:
    """JSON text: what was generated, from what, what it costs, and the SHA-256 of every file."""
    system = derivation.system
    fused = derivation.fused if "c/links_together.h" in files else None
    data = {
        "schema": SCHEMA,
        "name": derivation.package,
        "robot": system.name,
        "generator": {"linkwise": VERSION, "sympy": sp.__version__},
        "request": dict(derivation.request),
        "joints": [{"name": c.name, "unit": c.unit} for c in system.coordinates],
        "links": [
            {
                "name": link.name,
                "path": list(system.path(j)),
                "operations": decomposition_cost([derivation.kernels[j]]),
            }
            for j, link in enumerate(system.links)
        ],
        "fused_operations": decomposition_cost([fused]) if fused else None,
        "parameters": {s.name: float(v) for s, v in system.parameters.items()},
        "units": {
            "angle": "rad",
            "length": "m",
            "mass": "kg",
            "time": "s",
            "torque": "N m",
            "force": "N",
        },
        "conventions": {
            "index_order": "joint i, link j, coordinate k",
            "velocity": "closing: c1 = 1/2 d(tau)/d(qd) of the quadratic part; sum over k closes to tau_ij",
            "gravity": list(_floats(system)),
        },
        "skeleton": skeleton(system),
        "files": {path: hashlib.sha256(text.encode()).hexdigest() for path, text in sorted(files.items())},
    }
    return json.dumps(data, indent=1) + "\n"


def _value(system: System, scalar: Any) -> float:
    return float(sp.sympify(scalar).xreplace(dict(system.parameters)))


def _floats(system: System) -> Iterator[float]:
    if system.robot is not None:
        for entry in system.robot.gravity:
            yield _value(system, entry)


def skeleton(system: System) -> list[dict[str, Any]] | None:
    """Return where the links are, numbers only, to draw and to check; None for a user's own energies."""
    if system.robot is None:
        return None
    return [
        {
            "link": link.name,
            "parent": link.parent,
            "joint": link.joint.name,
            "kind": link.joint.kind,
            "coordinate": link.joint.coordinate,
            "ratio": link.joint.ratio,
            "rotation": [list(row) for row in link.joint.rotation],
            "translation": [_value(system, p) for p in link.joint.translation],
            "mass": _value(system, link.mass),
            "com": [_value(system, c) for c in link.com],
            "inertia": [[_value(system, entry) for entry in row] for row in link.inertia],
        }
        for link in system.robot.links
    ]
