"""The curve in the paper's own mechanism: operations of the graphs that autograd makes of τ_1.

For the arm of the first n links, recorded from its generated package: all of τ_1 = Σ_j D_1 L_j, against
(Σ_j ∂²K_j/∂q̇_1²) q̈_1. Operations are those on numbers, equal ones counted once; what hangs on parameters
alone, as a product of a mass and a length, is not counted, as it is the same at every instant.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from linkwise.dynamics.derive import derive
from linkwise.emit.assemble import package_files
from linkwise.emit.backend import chosen_backends
from linkwise.emit.derivation import Derivation
from linkwise.extras import extra
from linkwise.package.load import open_package
from linkwise.package.write import write_package
from linkwise.progress import Progress
from linkwise.report.term_count import TermPair
from linkwise.symbolic.system import System

FORM = (
    "operations recorded while torch's autograd differentiates the links' energies; equal ones once, those "
    "on parameters alone not at all"
)


def recorded_operations(system: System, links: int, progress: Progress) -> Iterator[TermPair]:
    """Counts for the first 1, 2, … `links` links of a serial arm; raises LinkwiseError without torch."""
    extra("torch")
    derivation = Derivation(system, derive(system), "recorded", {})
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "recorded"
        write_package(package_files(derivation, chosen_backends(["autograd"])), directory)
        robot: Any = open_package(directory).module.load("autograd", allow_unphysical=True)
        for n in range(1, links + 1):
            whole, part = robot.graph(0, range(n)), robot.graph(0, range(n), 0, 2)
            yield TermPair(_moving(whole), _moving(part))
            progress("record", n, links)


def _moving(graph: Any) -> int:
    """Operations that hang on a motion."""
    known = {leaf.key for leaf in graph.leaves if leaf.kind != "parameter"}
    for operation in graph.operations:
        if not known.isdisjoint(operation.operands):
            known.add(operation.key)
    return sum(operation.key in known for operation in graph.operations)
