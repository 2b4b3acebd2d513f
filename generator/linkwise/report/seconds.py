"""Measured time: one coefficient extracted, or everything computed, by a generated package."""

import importlib
import math
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

from linkwise.dynamics.derive import derive
from linkwise.dynamics.kernel import Kernel
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.render import render
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.expression.graph import Node
from linkwise.pipeline import generate
from linkwise.progress import Progress
from linkwise.report.extras import report_extra
from linkwise.symbolic.system import EnergySystem, System, rigid_system

BATCH = 1024
REPEATS, SHORTEST = 7, 0.02
"""Runs of which the fastest counts, and the least time of one run in s."""
PACKAGE = "linkwise_measured"


@dataclass(frozen=True)
class Timing:
    """µs a sample, batch 1,024, float64, one thread, for the first `dof` links.

    extract: the part of τ_1 with q̈_1 alone
    whole: τ_1 in closed form; by autograd every τ_i, which one sweep gives together
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
    """Time the arms of the first 1..n links of a serial arm, for each n of `dof`."""
    torch = report_extra("torch", "torch")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    timings: list[Timing] = []
    try:
        for done, n in enumerate(dof):
            timings += _of_arm(first_links(system, n), n)
            progress("measure", done + 1, len(dof))
    finally:
        torch.set_num_threads(threads)
    return tuple(timings)


def first_links(system: System, n: int) -> System:
    """Return the serial arm of the first n links."""
    if isinstance(system, EnergySystem):
        return replace(system, coordinates=system.coordinates[:n], links=system.links[:n])
    robot = system.robot
    return rigid_system(replace(robot, coordinates=robot.coordinates[:n], links=robot.links[:n]))


def machine() -> dict[str, str]:
    """Where the seconds were measured."""
    versions = {name: report_extra(name, "torch").__version__ for name in ("numpy", "torch")}
    return {"machine": platform.machine(), "python": platform.python_version(), **versions}


def _of_arm(system: System, n: int) -> Iterator[Timing]:
    numpy, torch = report_extra("numpy", "torch"), report_extra("torch", "torch")
    random = numpy.random.default_rng(n)
    q, qd, qdd = (random.standard_normal((BATCH, n)) for _ in range(3))
    kernels = derive(system)
    files = generate(system, ["numpy", "autograd"], name=PACKAGE)
    files["row.py"] = render("report/row.py.j2", row_view(system, kernels))
    with tempfile.TemporaryDirectory() as folder:
        package = _imported(files, Path(folder) / PACKAGE)
        closed, auto = package.load("numpy"), package.load("autograd")
        row = importlib.import_module(f"{PACKAGE}.row")
        p = closed.parameters
        times = _fastest(
            lambda: row.extract(q, qd, qdd, p),
            lambda: row.whole(q, qd, qdd, p),
            lambda: closed.coefficients(q, qd),
        )
        yield Timing(n, "closed form", *times)
        tq, tqd, tqdd = (torch.from_numpy(a) for a in (q, qd, qdd))
        times = _fastest(
            lambda: sum(_second(torch, module, tq, tqd) for module in auto.backend.modules) * tqdd[..., :1],
            lambda: auto.inverse_dynamics(tq, tqd, tqdd),
            lambda: auto.coefficients(tq, tqd),
        )
        yield Timing(n, "autograd", *times)
    _forget()


def _second(torch: Any, lagrangian: Any, q: Any, qd: Any) -> Any:
    """c2_1j1 = ∂²L_j/∂q̇_1², two reverse sweeps and nothing else."""
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


def row_view(system: System, kernels: tuple[Kernel, ...]) -> dict[str, Any]:
    """Functions for c2_1j1 and for τ_1j, written as the package writes its own."""
    coefficients = [
        _function(system, kernel, f"coefficient_{j + 1}", kernel.forms[0].acceleration[0, 0])
        for j, kernel in enumerate(kernels)
    ]
    torques = [
        _function(system, kernel, f"torque_{j + 1}", kernel.forms[0].torque[0])
        for j, kernel in enumerate(kernels)
    ]
    return {
        "functions": coefficients + torques,
        "coefficients": [function.name for function in coefficients],
        "torques": [function.name for function in torques],
    }


def _function(system: System, kernel: Kernel, name: str, output: Node) -> RowFunction:
    code = straight_line(kernel.graph, [output], PythonPrinter("np"))
    return RowFunction(name, fetched(system, code, "[..., {}]"), code.assignments, code.outputs[0])


def _imported(files: dict[str, str], folder: Path) -> ModuleType:
    for path, text in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
    sys.path.insert(0, str(folder.parent))
    try:
        return importlib.import_module(PACKAGE)
    finally:
        sys.path.remove(str(folder.parent))


def _forget() -> None:
    """Drop the measured package, so that the next arm's is imported afresh."""
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]
    importlib.invalidate_caches()


def _fastest(*calls: Callable[[], object]) -> list[float]:
    """µs a sample of each call: the fastest of a few runs, in turns so that all see one machine."""
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
