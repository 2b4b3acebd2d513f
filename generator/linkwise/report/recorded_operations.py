"""The curve by the paper's own mechanism: operations recorded while autograd computes τ_1.

For the arm of the first n links, recorded from its generated package: all of τ_1 = Σ_j D_1 L_j, against
(Σ_j ∂²K_j/∂q̇_1²) q̈_1. Operations are those on numbers, equal ones counted once; operations on parameters
alone, such as a product of a mass and a length, are not counted, as they are the same at every instant.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
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

NODES = (
    "as autograd keeps them while the links' modules are differentiated for vectors of motion, equal ones as "
    "often as they are made and those that take vectors apart among them"
)
FORM = (
    "operations recorded while torch's autograd differentiates the links' energies; equal ones once, those "
    "on parameters alone not at all"
)


@dataclass(frozen=True)
class RecordedPair(TermPair):
    """Operations of the graph of τ_1 and of its q̈_1 part; `nodes` are those that autograd keeps for both."""

    nodes: TermPair


def recorded_operations(system: System, links: int, progress: Progress) -> Iterator[RecordedPair]:
    """Yield counts for the first 1, 2, … `links` links of a serial arm.

    Raises LinkwiseError without torch.
    """
    extra("torch")
    derivation = Derivation(system, derive(system), "recorded", {})
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "recorded"
        write_package(package_files(derivation, chosen_backends(["autograd"])), directory)
        robot: Any = open_package(directory).module.load("autograd", allow_unphysical=True)
        for n in range(1, links + 1):
            whole, part = robot.graph(0, range(n)), robot.graph(0, range(n), 0, 2)
            yield RecordedPair(_moving(whole), _moving(part), _kept_nodes(robot, n))
            progress("record", n, links)


def _kept_nodes(robot: Any, links: int) -> TermPair:
    """Return the numbers of nodes behind τ_1 and behind its q̈_1 part.

    τ_1 is p_q · q̇ + p_q̇ · q̈ − ∂L/∂q_1 with p = ∂L/∂q̇_1, and its part Σ_j ∂p/∂q̇_1 q̈_1.
    """
    torch = extra("torch")
    q, qd, qdd = torch.full((3, robot.n), 0.3, dtype=torch.float64).unbind()
    for motion in (q, qd, qdd):
        motion.requires_grad_()
    torques, inertias = [], []
    for j in range(links):
        lagrangian = robot.links[j](q, qd)
        force, momentum = _slopes(lagrangian, q, qd)
        bends, rates = _slopes(momentum[0], q, qd)
        torques.append((bends * qd).sum() + (rates * qdd).sum() - force[0])
        inertias.append(rates[0])
    part = sum(inertias[1:], inertias[0]) * qdd[0]
    return TermPair(_nodes(sum(torques[1:], torques[0])), _nodes(part))


def _slopes(value: Any, *by: Any) -> Any:
    """Return derivatives that can be differentiated again; zeros where there is nothing to differentiate."""
    torch = extra("torch")
    if not value.requires_grad:
        return [torch.zeros_like(motion) for motion in by]
    return torch.autograd.grad(value, by, create_graph=True, allow_unused=True, materialize_grads=True)


def _nodes(value: Any) -> int:
    """Return the number of operations that a value came from, without the leaves."""
    found, waiting = set[Any](), [value.grad_fn]
    while waiting:
        node = waiting.pop()
        if node is not None and node not in found:
            found.add(node)
            waiting += [before for before, _ in node.next_functions]
    return sum(bool(node.next_functions) for node in found)


def _moving(graph: Any) -> int:
    """Return the number of operations that depend on a motion."""
    known = {leaf.key for leaf in graph.leaves if leaf.kind != "parameter"}
    for operation in graph.operations:
        if not known.isdisjoint(operation.operands):
            known.add(operation.key)
    return sum(operation.key in known for operation in graph.operations)
