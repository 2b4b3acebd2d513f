"""Everything of a generated package that is not one back end: names, loading, shared calls, manifest."""

import hashlib
import json
import keyword
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from linkwise.dynamics.derive import fused_kernel
from linkwise.dynamics.kernel import Kernel, decomposition_cost
from linkwise.emit.render import render
from linkwise.symbolic.system import System
from linkwise.version import VERSION

SCHEMA = 1
LONGEST_NAME = 60
TAKEN = {"numpy", "torch", "linkwise", *sys.stdlib_module_names}


@dataclass(frozen=True)
class Derivation:
    """What every back end emits from: the system, one kernel a link, and the request that led to it."""

    system: System
    kernels: tuple[Kernel, ...]
    package: str
    request: Mapping[str, Any]

    @cached_property
    def fused(self) -> Kernel | None:
        """Kernel of all links together, if there is one; found when first asked for."""
        return fused_kernel(self.system)

    @property
    def linear(self) -> frozenset[int]:
        """Links whose energy has terms linear in the velocities."""
        return frozenset(j for j, k in enumerate(self.kernels) if k.forms[0].velocity_linear)


def identifier(name: str) -> str:
    """Module name made of a robot's name: letters, digits, underscores; no keyword, no module in use."""
    text = re.sub(r"[^0-9a-z_]+", "_", name.lower()).strip("_")[:LONGEST_NAME] or "robot"
    if text[0].isdigit() or keyword.iskeyword(text) or text in TAKEN:
        text = f"robot_{text}"
    return text


def shared_files(derivation: Derivation, backends: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Files that serve every back end; `backends` are those that `load` is to know."""
    from linkwise.emit.backend import BACKENDS

    system = derivation.system
    shared = {"version": VERSION}
    names = {
        **shared,
        "joints": [ascii(c.name) for c in system.coordinates],
        "units": [repr(c.unit) for c in system.coordinates],
        "links": [ascii(link.name) for link in system.links],
        "paths": [repr(system.path(j)) for j in range(len(system.links))],
        "linear": repr(tuple(sorted(derivation.linear))),
        "parameters": [(ascii(s.name), repr(float(v))) for s, v in system.parameters.items()],
    }
    load = {
        **shared,
        "backends": tuple(backends),
        "default": repr(backends[0]) if backends else "None",
        "docs": [(name, BACKENDS[name].doc) for name in backends],
        "modules": {name: BACKENDS[name].module for name in backends},
    }
    yield "__init__.py", render("package/init.py.j2", {**shared, "package": derivation.package})
    yield "names.py", render("package/names.py.j2", names)
    yield "load.py", render("package/load.py.j2", load)
    yield "dynamics.py", render("package/dynamics.py.j2", shared)
    yield "packing.py", render("package/packing.py.j2", shared)
    if backends:
        yield "numpy_backend.py", render("package/numpy_backend.py.j2", shared)


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
