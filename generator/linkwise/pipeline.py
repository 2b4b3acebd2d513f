"""The way of the data, from a description to the files of a package.

    robot file ─read_robot─▶ Robot ─rigid_system─▶ RigidSystem ─┐
    energies in Python ─read_energies───────────▶ EnergySystem ─┤
                                                                ▼
    constrained_system   loops are closed, and independent coordinates found
    plan           the kernel is chosen, and what files there will be
    derive         closed forms, link by link: by the rigid-link rule, which differentiates nothing, or
                   by Euler–Lagrange from energies, those that a user wrote or, if asked for, those of rigid
                   links; left out where the kernel is in loops
    package_files  their text in each back end, the runtime, the manifest

SymPy energies of rigid links take no part in this otherwise: they are worked out for formulas and reports.
The autograd back end has a rigid link's energies from its joints and its body (`emit.rigid_energy`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from linkwise.constraints.constrained_system import constrained_system
from linkwise.dynamics.derive import Method, check_written, derive
from linkwise.emit.assemble import checked_identifier, package_files
from linkwise.emit.backend import BackendFiles, chosen_backends, usual_backends
from linkwise.emit.derivation import Derivation
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import is_file
from linkwise.kernel_choice import check_size, chosen_kernel
from linkwise.package.entries import KernelKind
from linkwise.progress import Progress, silent
from linkwise.robot import Options, read_robot, told_name
from linkwise.robot.robot import Robot
from linkwise.symbolic.energy_file import read_energies
from linkwise.symbolic.named_lines import with_line
from linkwise.symbolic.system import System, rigid_system

PYTHON = ".py"


def is_program(spec: str | Path) -> bool:
    """Return whether a robot is a Python file of energies, which is run to read it."""
    return Path(spec).suffix == PYTHON and is_file(Path(spec))


def read_system(spec: str | Path, options: Options | None = None, as_made: bool = False) -> System:
    """Return the system of a built-in robot, a robot's file, or a Python file of energies.

    Where such a file makes its `system` with numbers, these are taken with `as_made`, though the options ask
    for symbols. Raises LinkwiseError.
    """
    options = options or Options()
    if is_program(spec):
        with within(str(spec)):
            rigid = [f"--{name.replace('_', '-')}" for name in options.given if name != "parameters"]
            if rigid:
                raise LinkwiseError(
                    f"energies in Python do not accept {', '.join(rigid)}; change the energies"
                )
            energies = read_energies(Path(spec), options.parameters != "numeric", as_made)
            written = replace(energies, request={"robot": told_name(spec), **options.request()})
            try:
                check_written(written)
                return constrained_system(written)
            except LinkwiseError as error:
                raise LinkwiseError(with_line(str(error), Path(spec), {})) from error
    system = rigid_system(read_robot(spec, options))
    with within(str(spec)):
        return constrained_system(system)


@dataclass(frozen=True)
class PackagePlan:
    """A package that can be made: its system, its back ends, and how it was asked for.

    kernel: the one that was chosen
    name: of the package
    request: what its manifest keeps, so that it can be made again
    """

    system: System
    kernel: KernelKind
    backends: tuple[BackendFiles, ...]
    name: str
    derivation: Method
    request: Mapping[str, Any]
    vendor_runtime: bool

    def files(self, progress: Progress = silent) -> dict[str, str]:
        """Return the files of the package, {path inside the package: text}."""
        forms = derive(self.system, progress, self.derivation) if self.kernel == "straight" else ()
        derivation = Derivation(self.system, forms, self.name, self.request, self.vendor_runtime)
        return package_files(derivation, self.backends, progress)


def plan(
    robot: System | Robot,
    backends: Iterable[str] | None = None,
    name: str | None = None,
    kernel: str = "auto",
    derivation: Method = "rule",
    vendor_runtime: bool = False,
) -> PackagePlan:
    """Return what `generate` does with the same arguments, before anything is derived; raises as it does."""
    asked = None if backends is None else (backends,) if isinstance(backends, str) else tuple(backends)
    system = constrained_system(rigid_system(robot) if isinstance(robot, Robot) else robot)
    kind = chosen_kernel(system, kernel, asked, derivation)
    chosen = chosen_backends(usual_backends(system, kind) if asked is None else asked, kind)
    with within(system.name):
        check_size(system, kind, asked)
    request = {
        **system.request,
        "backends": [backend.name for backend in chosen],
        "kernel": kernel,
        "derivation": derivation,
        "vendor_runtime": vendor_runtime,
    }
    checked = checked_identifier(name, system.name)
    return PackagePlan(system, kind, chosen, checked, derivation, request, vendor_runtime)


def generate(
    robot: System | Robot,
    backends: Iterable[str] | None = None,
    name: str | None = None,
    progress: Progress = silent,
    kernel: str = "auto",
    derivation: Method = "rule",
    vendor_runtime: bool = False,
) -> dict[str, str]:
    """Return the files of a package, {path inside the package: text}.

    `backends`, several or one, are all that the robot can have if not given. `kernel` is straight, loops, or
    auto, which chooses by the robot's size; with loops no closed forms are derived, and `formulas` are not
    there. `derivation` says how closed forms of rigid links are derived: rule, which is cheaper, or energy,
    by Euler-Lagrange from SymPy energies. With `vendor_runtime` the package carries a copy of what it imports
    of linkwise_runtime, and stands alone.

    The manifest keeps these arguments, and the options that the robot was read with: how to make the package
    again. Raises LinkwiseError for a name, back end or kernel that cannot be, before anything is derived.
    """
    return plan(robot, backends, name, kernel, derivation, vendor_runtime).files(progress)
