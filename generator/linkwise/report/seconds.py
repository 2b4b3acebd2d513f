"""Measured time of a generated package: to extract one coefficient, or to compute everything."""

import importlib
import math
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.dynamics.derive import derive
from linkwise.dynamics.link_forms import LinkForms
from linkwise.emit.assemble import package_files
from linkwise.emit.backend import chosen_backends
from linkwise.emit.derivation import Derivation
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.expression.expression_graph import Node
from linkwise.extras import extra
from linkwise.package.load import Package, open_package
from linkwise.package.write import write_package
from linkwise.progress import Progress
from linkwise.render import render
from linkwise.symbolic.system import EnergySystem, System, rigid_system

BATCH = 1024
METHODS = ("closed form", "autograd")
REPEATS, SHORTEST = 7, 0.02
"""Number of runs, of which the fastest counts, and the least time of one run in s."""


@dataclass(frozen=True)
class Timing:
    """Times in µs for each sample, batch 1,024, float64, one thread, for the first `dof` links.

    extract: the part of τ_1 with q̈_1 alone
    whole: τ_1 in closed form; by autograd every τ_i, as one sweep gives all of them
    everything: all coefficients of all links
    """

    dof: int
    method: str
    extract: float
    whole: float
    everything: float

    @property
    def reduction(self) -> float:
        """Share of the time that extracting saves; negative where it takes longer."""
        return 1.0 - self.extract / self.whole


def measure(system: System, dof: tuple[int, ...], progress: Progress) -> tuple[Timing, ...]:
    """Return the times of the arm of the first n links of a serial arm, for each n of `dof`."""
    torch = extra("torch")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    timings: list[Timing] = []
    try:
        for done, n in enumerate(dof):
            with tempfile.TemporaryDirectory() as folder:
                package = _generated(first_links(system, n), Path(folder) / "measured")
                timings += [_closed_form(package, n), _autograd(package, n)]
            progress("measure", done + 1, len(dof))
    finally:
        torch.set_num_threads(threads)
    return tuple(timings)


def first_links(system: System, n: int) -> System:
    """Return the serial arm of the first n links."""
    if isinstance(system, EnergySystem):
        return replace(system, coordinates=system.coordinates[:n], links=system.links[:n])
    robot, last = system.robot, system.links[n - 1].chain[-1]
    part = replace(
        robot,
        coordinates=robot.coordinates[:n],
        links=robot.links[: last + 1],
        frames=tuple(frame for frame in robot.frames if frame.link is None or frame.link <= last),
        passive=tuple(axis for axis in robot.passive if axis.coordinate < n),
    )
    return rigid_system(part)


def _generated(system: System, directory: Path) -> Package:
    """Return the package of `system`, with an additional module: row.py, which computes τ_1 alone."""
    derivation = Derivation(system, derive(system), directory.name, {})
    files = package_files(derivation, chosen_backends(("numpy", "autograd")))
    files["row.py"] = render("report/row.py.j2", row_view(system, derivation.forms))
    write_package(files, directory)
    return open_package(directory)


def _closed_form(package: Package, n: int) -> Timing:
    q, qd, qdd = _motion(n)
    robot = package.module.load("numpy")
    row = importlib.import_module(f"{package.module.__name__}.row")
    p = robot.parameters
    return Timing(
        n,
        METHODS[0],
        *_fastest(
            lambda: row.extract(q, qd, qdd, p),
            lambda: row.whole(q, qd, qdd, p),
            lambda: robot.coefficients(q, qd),
        ),
    )


def _autograd(package: Package, n: int) -> Timing:
    torch = extra("torch")
    q, qd, qdd = (torch.from_numpy(a) for a in _motion(n))
    robot = package.module.load("autograd")
    lagrangians = robot.backend.modules
    return Timing(
        n,
        METHODS[1],
        *_fastest(
            lambda: sum(_second(torch, module, q, qd) for module in lagrangians) * qdd[..., :1],
            lambda: robot.inverse_dynamics(q, qd, qdd),
            lambda: robot.coefficients(q, qd),
        ),
    )


def _motion(n: int) -> Iterator[Any]:
    random = np.random.default_rng(n)
    return (random.standard_normal((BATCH, n)) for _ in range(3))


def _second(torch: Any, lagrangian: Any, q: Any, qd: Any) -> Any:
    """Return c2_1j1 = ∂²L_j/∂q̇_1², by two reverse sweeps and nothing else."""
    first = qd[..., :1].detach().requires_grad_()
    energy = lagrangian(q, torch.cat([first, qd[..., 1:]], -1)).sum()
    (slope,) = torch.autograd.grad(energy, first, create_graph=True)
    return torch.autograd.grad(slope.sum(), first)[0]


@dataclass(frozen=True)
class RowFunction:
    """One emitted function of one link."""

    name: str
    inputs: tuple[str, ...]
    assignments: tuple[tuple[str, str], ...]
    output: str


def row_view(system: System, links: tuple[LinkForms, ...]) -> dict[str, Any]:
    """Return functions for c2_1j1 and for τ_1j, written as the package's own functions are."""
    coefficients = [
        _function(system, forms, f"coefficient_{j + 1}", forms.acceleration[0, 0])
        for j, forms in enumerate(links)
    ]
    torques = [_function(system, forms, f"torque_{j + 1}", forms.torque[0]) for j, forms in enumerate(links)]
    return {
        "functions": coefficients + torques,
        "coefficients": [function.name for function in coefficients],
        "torques": [function.name for function in torques],
    }


def _function(system: System, forms: LinkForms, name: str, output: Node) -> RowFunction:
    code = straight_line(forms.graph, [output], PythonPrinter("np"))
    return RowFunction(name, fetched(system, code, "[..., {}]"), code.assignments, code.outputs[0])


def _fastest(*calls: Callable[[], object]) -> list[float]:
    """Return µs for each sample of each call: the fastest of several runs.

    Calls take turns, so that all run under the same conditions.
    """
    loops = []
    for call in calls:
        call()
        loops.append(max(1, round(SHORTEST / max(_elapsed(call, 1), 1e-9))))
    best = [math.inf] * len(calls)
    for _ in range(REPEATS):
        for at, call in enumerate(calls):
            best[at] = min(best[at], _elapsed(call, loops[at]) / loops[at])
    return [seconds / BATCH * 1e6 for seconds in best]


def _elapsed(call: Callable[[], object], times: int) -> float:
    started = time.perf_counter()
    for _ in range(times):
        call()
    return time.perf_counter() - started
