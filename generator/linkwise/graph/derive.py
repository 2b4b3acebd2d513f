"""From link energies to kernels: the closed forms of one link, or of all, on one graph.

A rigid link's common frame is free; a few are tried, and the one that costs the fewest operations is kept.
"""

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
MAX_FUSED = 4000
"""Largest sum of squared path lengths for a fused kernel."""

Tree = Sequence[tuple[int, Joint]]
Attempt = tuple[int, CommonAxes, Origin]


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
        search = _Search(system, [energy], tree, [range(len(tree))])
        _, axes, origin = min([*search.central(MAX_AXES), *search.framed(MAX_AXES)], key=itemgetter(0))
        return search.build(axes, origin)


def fused_kernel(system: System) -> Kernel | None:
    """Decomposition of every link of a rigid robot on one graph, in one common frame, where they share work.

    None for energies of a user's own, and for a robot so large that finding the frame takes too long.
    """
    if system.robot is None or len(system.links) < 2:
        return None
    tree = [(-1 if k.parent is None else k.parent, k.joint) for k in system.robot.links]
    chains = [energy.body.chain for energy in system.links if energy.body is not None]
    if sum(len(chain) ** 2 for chain in chains) > MAX_FUSED:
        return None
    search = _Search(system, system.links, tree, chains)
    _, axes, origin = min(search.framed(MAX_AXES - 1), key=itemgetter(0))
    return search.build(axes, origin, gradient=False)


def _energy_kernel(system: System, energy: LinkEnergy, path: tuple[int, ...]) -> Kernel:
    lower, x = lowering(system)
    lagrangian = lower.graph.sub(lower(energy.kinetic), lower(energy.potential))
    forms = euler_lagrange(lower.graph, lagrangian, path, x)
    return Kernel(lower.graph, x, _parameters(system, lower), (forms,))


class _Search:
    """Common frames for some links of a tree, by what their decomposition costs."""

    def __init__(
        self, system: System, links: Sequence[LinkEnergy], tree: Tree, chains: Sequence[Sequence[int]]
    ) -> None:
        self.system, self.tree, self.chains = system, tree, chains
        self.bodies = [energy.body for energy in links if energy.body is not None]

    def build(self, axes: CommonAxes, origin: Origin, gradient: bool = True) -> Kernel:
        """Kernel in a common frame, with or without the position gradient."""
        lower, x = lowering(self.system)
        turn = Orientation(lower, self.tree, self.bodies[0].gravity, axes, x)
        forms = tuple(
            rigid_forms(turn, body, chain, origin, gradient)
            for body, chain in zip(self.bodies, self.chains, strict=True)
        )
        return Kernel(lower.graph, x, _parameters(self.system, lower), forms)

    def attempt(self, axes: CommonAxes, origin: Origin) -> Attempt:
        """Operations of a common frame, and the frame."""
        kernel = self.build(axes, origin, gradient=False)
        outputs = [node for forms in kernel.forms for node in forms.decomposition()]
        return count_operations(kernel.graph, outputs).arithmetic, axes, origin

    def framed(self, most_axes: int) -> Iterator[Attempt]:
        """Frames of the longest chain, their own axes and origin, then the best with other origins."""
        longest = max(self.chains, key=len)
        tried = [self.attempt(axes, Origin(axes.frame)) for axes in _axes(longest, most_axes)]
        yield from tried
        best = min(tried, key=itemgetter(0))[1]
        for frame in _spread([-1, *longest], MAX_ORIGINS):
            if frame != best.frame:
                yield self.attempt(best, Origin(frame))

    def central(self, most_axes: int) -> Iterator[Attempt]:
        """Origins in the one link's centre of mass, with principal axes too; the best one also by points."""
        chain, body = self.chains[0], self.bodies[0]
        axes = list(_axes(chain, most_axes))
        if principal := principal_axes(body):
            axes.append(CommonAxes(chain[-1], turned=principal))
        tried = [self.attempt(candidate, Origin()) for candidate in axes]
        yield from tried
        yield self.attempt(min(tried, key=itemgetter(0))[1], Origin(by_points=True))


def _axes(chain: Sequence[int], most: int) -> Iterator[CommonAxes]:
    """Axes to try: the base's, and those before and behind joints spread over the chain."""
    yield CommonAxes(-1)
    for f in _spread(chain, most):
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
