"""The way of the data: description -> energies -> graph -> text -> package. It only reads the description."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from linkwise.emit import BACKENDS
from linkwise.emit.package import Derivation, identifier, manifest, shared_files
from linkwise.errors import LinkwiseError, within
from linkwise.graph.derive import Kernel, link_kernel
from linkwise.model import Options, read_robot
from linkwise.model.robot import Robot
from linkwise.progress import Progress, silent
from linkwise.symbolic.energies import read_energies
from linkwise.symbolic.rigid import link_energies
from linkwise.symbolic.system import System


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


def derive(system: System, progress: Progress = silent) -> tuple[Kernel, ...]:
    """One kernel a link: its closed forms on a graph."""
    kernels = []
    for j in range(len(system.links)):
        progress("derive", j, len(system.links))
        with within(f"while deriving robot {system.name!r}"):
            kernels.append(link_kernel(system, j))
    progress("derive", len(system.links), len(system.links))
    return tuple(kernels)


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
    for number, backend in enumerate(chosen):
        progress("emit", number, len(chosen))
        files.update(BACKENDS[backend].files(derivation))
    progress("emit", len(chosen), len(chosen))
    files.update(shared_files(derivation, [b for b in chosen if BACKENDS[b].module]))
    files["manifest.json"] = manifest(derivation, files)
    return files


def _chosen(backends: Iterable[str]) -> tuple[str, ...]:
    names = list(backends)
    for name in names:
        if name not in BACKENDS:
            raise LinkwiseError(f"no back end {name!r}; choose among {', '.join(BACKENDS)}")
    names += [needed for name in names for needed in BACKENDS[name].needs]
    return tuple(name for name in BACKENDS if name in names)
