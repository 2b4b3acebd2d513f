"""The way of the data: description -> energies -> graph -> text -> package. It only reads the description."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from linkwise.dynamics.derive import derive
from linkwise.emit.assemble import identifier, manifest, shared_files
from linkwise.emit.backend import BACKENDS, BackendFiles
from linkwise.emit.derivation import Derivation
from linkwise.errors import LinkwiseError, within
from linkwise.progress import Progress, silent
from linkwise.robot import Options, read_robot
from linkwise.robot.robot import Robot
from linkwise.symbolic.link_energy import link_energies
from linkwise.symbolic.system import System
from linkwise.symbolic.user_energies import read_energies


def read_system(spec: str | Path, options: Options | None = None) -> System:
    """Coordinates and link energies of a built-in robot, a robot's file, or a Python file of energies."""
    options = options or Options()
    if Path(spec).suffix == ".py" and Path(spec).is_file():
        with within(str(spec)):
            if options.lock or options.root or options.tip or options.base != "fixed":
                raise LinkwiseError(
                    "energies in Python take no --lock, --root, --tip or --base; change the energies"
                )
            return read_energies(Path(spec), options.parameters == "symbolic")
    return link_energies(read_robot(spec, options))


def generate(
    robot: System | Robot,
    backends: Iterable[str] = tuple(BACKENDS),
    name: str | None = None,
    request: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> dict[str, str]:
    """Files of a package, {path inside the package: text}.

    `request` goes into the manifest, so that a reader sees how to make the package again.
    Raises LinkwiseError for a name or back end that cannot be.
    """
    system = link_energies(robot) if isinstance(robot, Robot) else robot
    chosen = _chosen(backends)
    package = name if name is not None else identifier(system.name)
    if package != identifier(package):
        raise LinkwiseError(
            f"--name {package[:80]!r} is no module name of its own; use up to 60 letters a-z, digits and _"
        )
    derivation = Derivation(system, derive(system, progress), package, request or {})
    files: dict[str, str] = {}
    emitters = list(dict.fromkeys(emitter for backend in chosen for emitter in backend.emits))
    for number, emitter in enumerate(emitters):
        progress("emit", number, len(emitters))
        files.update(emitter(derivation))
    progress("emit", len(emitters), len(emitters))
    files.update(shared_files(derivation, chosen))
    files["manifest.json"] = manifest(derivation, files)
    return files


def _chosen(backends: Iterable[str]) -> tuple[BackendFiles, ...]:
    """Back ends by name and those that they need, in the registry's order."""
    names = list(backends)
    for name in names:
        if name not in BACKENDS:
            raise LinkwiseError(f"no back end {name!r}; choose among {', '.join(BACKENDS)}")
    names += [needed for name in names for needed in BACKENDS[name].needs]
    return tuple(backend for name, backend in BACKENDS.items() if name in names)
