"""From link energies to kernels: the closed forms of one link, or of all, on one graph."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter

import sympy as sp

from linkwise.errors import within
from linkwise.graph.count import count_operations
from linkwise.graph.euler_lagrange import euler_lagrange
from linkwise.graph.expression import Graph, Node
from linkwise.graph.forms import Inputs, LinkForms, inputs
from linkwise.graph.lower import Lowering
from linkwise.graph.orientation import CommonAxes, Orientation
from linkwise.graph.principal import principal_axes
from linkwise.graph.rigid_rule import Origin, rigid_forms
from linkwise.model.robot import Joint
from linkwise.symbolic.system import LinkEnergy, System

MAX_AXES, MAX_ORIGINS = 4, 3

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
    """Try a few common frames and keep the one that costs the fewest operations.

    First each set of axes, with the origin in the centre of mass and in the frame of the axes; then variants
    of what was best: other frames' origins, and velocities by points.
    """
    longest = max(chains, key=len)
    bodies = [energy.body for energy in links if energy.body is not None]

    def build(axes: CommonAxes, origin: Origin, gradient: bool) -> Kernel:
        lower, x = lowering(system)
        turn = Orientation(lower, tree, bodies[0].gravity, axes, x)
        forms = tuple(
            rigid_forms(turn, body, chain, origin, gradient)
            for body, chain in zip(bodies, chains, strict=True)
        )
        return Kernel(lower.graph, x, _parameters(system, lower), forms)

    def attempt(axes: CommonAxes, origin: Origin) -> tuple[int, CommonAxes, Origin]:
        kernel = build(axes, origin, gradient=False)
        outputs = [node for forms in kernel.forms for node in forms.decomposition()]
        return count_operations(kernel.graph, outputs).arithmetic, axes, origin

    candidates = list(_axes(longest))
    own = [CommonAxes(longest[-1], turned=principal)] if (principal := principal_axes(bodies[-1])) else []
    central = min((attempt(axes, Origin()) for axes in [*candidates, *own]), key=itemgetter(0))
    framed = min((attempt(axes, Origin(axes.frame)) for axes in candidates), key=itemgetter(0))
    variants = [(central[1], Origin(by_points=True))]
    frames = [f for f in _spread([-1, *longest], MAX_ORIGINS) if f != framed[1].frame]
    variants += [(framed[1], Origin(f)) for f in frames]
    _, axes, origin = min([central, framed, *(attempt(*v) for v in variants)], key=itemgetter(0))
    return build(axes, origin, gradient=True)


def _axes(chain: Sequence[int]) -> Iterator[CommonAxes]:
    """Axes to try: the base's, and those before and behind joints spread over the chain."""
    yield CommonAxes(-1)
    for f in _spread(chain, MAX_AXES):
        yield CommonAxes(f)
        yield CommonAxes(f, before=True)


def _spread(items: Sequence[int], most: int) -> list[int]:
    """At most `most` of the items: all of the first few, then spread evenly to the last."""
    if len(items) <= most:
        return list(items)
    near = list(items[: most // 2])
    step = (len(items) - 1 - len(near)) / (most - len(near) - 1)
    return near + [items[round(len(near) + step * k)] for k in range(most - len(near))]


def _parameters(system: System, lower: Lowering) -> dict[sp.Symbol, Node]:
    return {symbol: lower.symbols[symbol] for symbol in system.parameters}
