"""Parts of a generated package that are of no single back end: names, loading, shared calls, manifest."""

import hashlib
import keyword
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path

import sympy as sp
from linkwise_runtime.version import VERSION

from linkwise.emit.backend import BackendFiles
from linkwise.emit.bodies import body_texts, parameter_rules
from linkwise.emit.c import loop_costs
from linkwise.emit.c.flash import code_size
from linkwise.emit.constraint_forms import constraint_files
from linkwise.emit.derivation import Derivation
from linkwise.emit.shared_texts import init_text, names_text
from linkwise.emit.vendored_runtime import with_runtime
from linkwise.errors import LinkwiseError
from linkwise.package.entries import LinkEntry, RuntimeEntry
from linkwise.package.manifest import FILE, Manifest
from linkwise.package.runtime_imports import RUNTIME
from linkwise.progress import Progress, silent
from linkwise.symbolic.definition import (
    energies,
    file_joint_entries,
    follower_entries,
    formula_texts,
    in_radians,
    joint_entries,
    joint_tree,
    passive_joints,
)
from linkwise.symbolic.system import EnergySystem, RigidSystem

LONGEST_NAME = 60
DEVICES = {"aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
"""Names of devices, which no file of Windows may have, whatever follows after a dot."""
LINK_HEADER = re.compile(r"link_\d+")
"""Pattern of headers beside that of a package's own name."""
HEADERS = {Path(file.name).stem for file in resources.files("linkwise").joinpath("c").iterdir()}
"""Headers of every robot: their include guards and functions begin with their names, as a package's own
do."""
TAKEN = {"numpy", "torch", "linkwise", RUNTIME, *sys.stdlib_module_names, *DEVICES, *HEADERS}


def package_files(
    derivation: Derivation, backends: Sequence[BackendFiles], progress: Progress = silent
) -> dict[str, str]:
    """Return the files of a package with these back ends: {path inside the package: text}."""
    files: dict[str, str] = {}
    emitters = list(dict.fromkeys(emitter for backend in backends for emitter in backend.emits))
    for number, emitter in enumerate(emitters):
        progress("emit", number, len(emitters))
        files.update(emitter(derivation))
    progress("emit", len(emitters), len(emitters))
    files.update(shared_files(derivation, backends))
    if derivation.vendor_runtime:
        files = with_runtime(files)
    files[FILE] = manifest(derivation, files).text()
    return files


def identifier(name: str) -> str:
    """Return a module name made of a robot's name: letters, digits, underscores; not a keyword or in use."""
    text = re.sub(r"[^0-9a-z_]+", "_", name.lower()).strip("_")[:LONGEST_NAME] or "robot"
    if text[0].isdigit() or _is_taken(text):
        text = f"robot_{text}"
    return text


def checked_identifier(name: str | None, robot: str) -> str:
    """Return the package name asked for, or one made of the robot's name.

    Raises LinkwiseError for one that cannot be.
    """
    package = name if name is not None else identifier(robot)
    if fault := _fault_of_name(package):
        raise LinkwiseError(
            f"--name {package[:80]!r} is not a usable module name, as it {fault}; "
            f"use up to {LONGEST_NAME} letters a-z and A-Z, digits and _"
        )
    return package


def _fault_of_name(name: str) -> str:
    """Return why a name is no module name: which character, or what else; empty for one that is."""
    if wrong := re.search(r"[^0-9A-Za-z_]", name):
        return f"has {wrong[0]!r} at place {wrong.start() + 1}"
    if not name:
        return "is empty"
    if len(name) > LONGEST_NAME:
        return f"has {len(name)} characters"
    if name[0].isdigit():
        return f"begins with the digit {name[0]!r}"
    if name != name.strip("_"):
        return "begins or ends with '_'"
    if name.lower() in DEVICES:
        return "is what a device of Windows is called"
    return "is a word of Python's, or the name of a module or of a header of C" if _is_taken(name) else ""


def _is_taken(name: str) -> bool:
    """Return whether something else has the name, also where the names of files fold case."""
    folded = name.lower()
    return keyword.iskeyword(name) or folded in TAKEN or LINK_HEADER.fullmatch(folded) is not None


def shared_files(derivation: Derivation, chosen: Iterable[BackendFiles]) -> Iterator[tuple[str, str]]:
    """Yield the files that serve every back end; `load` is to know those `chosen`."""
    system, bodies = derivation.system, body_texts(derivation.system)
    parameters = {s.name: float(v) for s, v in system.parameters.items()}
    loadable = [backend for backend in chosen if backend.loading]
    about = parameter_rules(system, bodies)
    rigid = isinstance(system, RigidSystem)
    yield "__init__.py", init_text(derivation.package, loadable, parameters, about, rigid, derivation.kernel)
    links = {name: system.path(j) for j, name in enumerate(system.link_names)}
    yield (
        "names.py",
        names_text(
            derivation.package,
            joint_entries(system),
            links,
            derivation.nonquadratic,
            parameters,
            bodies,
            passive_joints(system),
            file_joint_entries(system),
            energies(system),
        ),
    )
    if isinstance(system, EnergySystem):
        yield from constraint_files(system)
    yield "py.typed", ""


def manifest(derivation: Derivation, files: Mapping[str, str]) -> Manifest:
    """Return the manifest: what was generated, from what, its costs, and the SHA-256 of every file."""
    system = derivation.system
    costs, operations = _costs(derivation)
    return Manifest(
        derivation.package,
        system.name,
        {"linkwise": VERSION, "sympy": sp.__version__},
        RuntimeEntry(VERSION, derivation.vendor_runtime),
        dict(derivation.request),
        derivation.kernel,
        joint_entries(system),
        tuple(
            LinkEntry(name, system.path(j), cost)
            for j, (name, cost) in enumerate(zip(system.link_names, costs, strict=True))
        ),
        follower_entries(system),
        file_joint_entries(system),
        in_radians(system),
        operations,
        code_size(derivation.package, files),
        {s.name: float(v) for s, v in system.parameters.items()},
        joint_tree(system),
        passive_joints(system),
        formula_texts(system),
        energies(system),
        {path: hashlib.sha256(text.encode()).hexdigest() for path, text in sorted(files.items())},
    )


def _costs(derivation: Derivation) -> tuple[list[int], int]:
    """Return the operations of each link's decomposition by itself, and of all links.

    Loops move the robot once for all links.
    """
    system = derivation.system
    if derivation.kernel == "loops" and isinstance(system, RigidSystem):
        return loop_costs.link_costs(system), loop_costs.decomposition_cost(system)
    costs = [forms.decomposition_cost for forms in derivation.forms]
    return costs, sum(costs)
