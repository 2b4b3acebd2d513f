"""From link energies to kernels: the closed forms of one link, or of all, on one graph."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from linkwise.errors import within
from linkwise.graph.count import count_operations
from linkwise.graph.euler_lagrange import euler_lagrange
from linkwise.graph.expression import Graph, Node
from linkwise.graph.forms import Inputs, LinkForms, inputs
from linkwise.graph.lower import Lowering
from linkwise.graph.rigid_rule import CommonFrame, Kinematics, rigid_forms
from linkwise.model.robot import Joint
from linkwise.symbolic.system import LinkEnergy, System

MAX_AXES, MAX_ORIGINS = 7, 5

Tree = Sequence[tuple[int, Joint]]


@dataclass(frozen=True)
class Kernel:
    """A graph, its inputs, the nodes of the parameters by symbol, and the forms of the links it computes."""

    graph: Graph
    inputs: Inputs
    parameters: dict[sp.Symbol, Node]
    forms: tuple[LinkForms, ...]


def lowering(system: System) -> tuple[Lowering, Inputs]:
    """Return an empty graph with symbols for the coordinates, velocities and parameters."""
    graph = Graph()
    x = inputs(graph, len(system.coordinates))
    symbols = {c.q: node for c, node in zip(system.coordinates, x.q, strict=True)}
    symbols |= {c.qd: node for c, node in zip(system.coordinates, x.qd, strict=True)}
    symbols |= {p: graph.symbol(name) for p, name in parameter_names(system).items()}
    return Lowering(graph, symbols), x


def parameter_names(system: System) -> dict[sp.Symbol, str]:
    """Identifiers of the run-time parameters: their names made safe, and told apart when they then agree."""
    names: dict[sp.Symbol, str] = {}
    for symbol in system.parameters:
        safe = "".join(c if c.isascii() and c.isalnum() else "_" for c in symbol.name)
        name = f"p_{safe}"
        while name in names.values():
            name += "_"
        names[symbol] = name
    return names


def link_kernel(system: System, link: int) -> Kernel:
    """Closed forms of one link from its own path alone, whatever else the robot has."""
    energy = system.links[link]
    with within(f"link {energy.name!r}"):
        if energy.body is None:
            return _energy_kernel(system, energy, system.path(link))
        tree = [(f - 1, joint) for f, joint in enumerate(energy.body.joints)]
        return _rigid_kernel(system, [energy], tree, [range(len(tree))])


def fused_kernel(system: System) -> Kernel:
    """Closed forms of every link of a rigid robot on one graph, in one common frame."""
    if system.robot is None:
        raise ValueError("only rigid robots have a fused kernel")
    tree = [(-1 if k.parent is None else k.parent, k.joint) for k in system.robot.links]
    chains = [energy.body.chain for energy in system.links if energy.body is not None]
    return _rigid_kernel(system, list(system.links), tree, chains)


def _energy_kernel(system: System, energy: LinkEnergy, path: tuple[int, ...]) -> Kernel:
    lower, x = lowering(system)
    lagrangian = lower.graph.sub(lower(energy.kinetic), lower(energy.potential))
    forms = euler_lagrange(lower.graph, lagrangian, path, x)
    return Kernel(lower.graph, x, _parameters(system, lower), (forms,))


def _rigid_kernel(
    system: System, links: list[LinkEnergy], tree: Tree, chains: Sequence[Sequence[int]]
) -> Kernel:
    """Try a few common frames and keep the one that costs the fewest operations."""
    best: tuple[int, CommonFrame, Kernel] | None = None

    def attempt(frame: CommonFrame) -> None:
        nonlocal best
        lower, x = lowering(system)
        first = next(e.body for e in links if e.body is not None)
        kin = Kinematics(lower, tree, first.gravity, frame, x)
        forms = tuple(
            rigid_forms(kin, e.body, chain)
            for e, chain in zip(links, chains, strict=True)
            if e.body is not None
        )
        kernel = Kernel(lower.graph, x, _parameters(system, lower), forms)
        cost = count_operations(lower.graph, [o for f in forms for o in f.decomposition()]).arithmetic
        if best is None or cost < best[0]:
            best = cost, frame, kernel

    longest = max(chains, key=len)
    for frame in _axes(longest):
        attempt(frame)
    assert best is not None
    chosen = best[1]
    for origin in _spread([-1, *longest], MAX_ORIGINS):
        if origin != chosen.origin:
            attempt(CommonFrame(chosen.axes, chosen.before, origin))
    return best[2]


def _axes(chain: Sequence[int]) -> Iterator[CommonFrame]:
    """Frames to try, each with its own origin: before and behind joints spread over the chain."""
    for f in _spread(chain, MAX_AXES):
        yield CommonFrame(f, False, f)
        yield CommonFrame(f, True, f)


def _spread(items: Sequence[int], most: int) -> list[int]:
    """At most `most` of the items: all of the first few, then spread evenly to the last."""
    if len(items) <= most:
        return list(items)
    near = list(items[: most // 2])
    step = (len(items) - 1 - len(near)) / (most - len(near) - 1)
    return near + [items[round(len(near) + step * k)] for k in range(most - len(near))]


def _parameters(system: System, lower: Lowering) -> dict[sp.Symbol, Node]:
    return {symbol: lower.symbols[symbol] for symbol in system.parameters}
