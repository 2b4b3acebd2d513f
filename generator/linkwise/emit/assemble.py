"""Everything of a generated package that is not one back end: names, loading, shared calls, manifest."""

import hashlib
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
from linkwise.package.manifest import FILE, BodyEntry, JointEntry, LinkEntry, Manifest, RigidTree
from linkwise.progress import Progress, silent
from linkwise.robot.robot import Scalar, Vec3
from linkwise.symbolic.system import System
from linkwise.version import VERSION

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


def package_files(
    derivation: Derivation, backends: Sequence[str], progress: Progress = silent
) -> dict[str, str]:
    """Files of a package with these back ends, in the registry's order: {path inside the package: text}."""
    from linkwise.emit.backend import BACKENDS

    files: dict[str, str] = {}
    for number, backend in enumerate(backends):
        progress("emit", number, len(backends))
        files.update(BACKENDS[backend].files(derivation))
    progress("emit", len(backends), len(backends))
    files.update(shared_files(derivation, [b for b in backends if BACKENDS[b].module]))
    files[FILE] = manifest(derivation, files).text()
    return files


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


def manifest(derivation: Derivation, files: Mapping[str, str]) -> Manifest:
    """What was generated, from what, what it costs, and the SHA-256 of every file."""
    system = derivation.system
    shared = derivation.fused if "c/fused.inc" in files else None
    return Manifest(
        derivation.package,
        system.name,
        {"linkwise": VERSION, "sympy": sp.__version__},
        dict(derivation.request),
        tuple(JointEntry(c.name, c.unit) for c in system.coordinates),
        tuple(
            LinkEntry(link.name, system.path(j), decomposition_cost([kernel]))
            for j, (link, kernel) in enumerate(zip(system.links, derivation.kernels, strict=True))
        ),
        decomposition_cost([shared]) if shared else None,
        {s.name: float(v) for s, v in system.parameters.items()},
        rigid_tree(system),
        {path: hashlib.sha256(text.encode()).hexdigest() for path, text in sorted(files.items())},
    )


def rigid_tree(system: System) -> RigidTree | None:
    """Return where the bodies are, numbers only, to draw and to check; None for a user's own energies."""
    robot = system.robot
    if robot is None:
        return None
    values = dict(system.parameters)

    def number(scalar: Scalar) -> float:
        return float(sp.sympify(scalar).xreplace(values))

    def numbers(a: Vec3) -> tuple[float, float, float]:
        return number(a[0]), number(a[1]), number(a[2])

    return RigidTree(
        numbers(robot.gravity),
        tuple(
            BodyEntry(
                link.name,
                link.parent,
                link.joint.name,
                link.joint.kind,
                link.joint.coordinate,
                link.joint.ratio,
                link.joint.rotation,  # type: ignore[arg-type]
                numbers(link.joint.translation),
                number(link.mass),
                numbers(link.com),
                (numbers(link.inertia[0]), numbers(link.inertia[1]), numbers(link.inertia[2])),
            )
            for link in robot.links
        ),
    )
