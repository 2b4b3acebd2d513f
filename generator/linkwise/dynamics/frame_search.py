"""Search for the common frame of the rigid-link rule: a few are tried, that of fewest operations is kept."""

from collections.abc import Iterator, Sequence
from operator import itemgetter

from linkwise.dynamics.kernel import Kernel, lowering, parameter_nodes
from linkwise.dynamics.link_motion import Origin
from linkwise.dynamics.rigid_link import rigid_forms
from linkwise.dynamics.screws import CommonAxes, Orientation
from linkwise.expression.count import count_operations
from linkwise.robot.robot import Joint
from linkwise.symbolic.system import RigidLink, RigidSystem

MAX_AXES, MAX_ORIGINS = 4, 3

Tree = Sequence[tuple[int, Joint]]
Attempt = tuple[int, CommonAxes, Origin]


class FrameSearch:
    """Search for a common frame for some links of a tree, by the cost of their decomposition.

    links: indices of the links in the system; chains: path of each in `tree`, which lists (parent, joint)
    """

    def __init__(
        self, system: RigidSystem, links: Sequence[int], tree: Tree, chains: Sequence[Sequence[int]]
    ) -> None:
        self.system, self.tree, self.chains = system, tree, chains
        self.links = [system.links[j] for j in links]

    def build(self, axes: CommonAxes, origin: Origin, gradient: bool = True) -> Kernel:
        """Return the kernel in a common frame, with or without the position gradient."""
        lower, x = lowering(self.system)
        turn = Orientation(lower, self.tree, self.system.robot.gravity, axes, x)
        forms = tuple(
            rigid_forms(turn, link, chain, origin, gradient)
            for link, chain in zip(self.links, self.chains, strict=True)
        )
        frame = _axes_in_words(turn, axes), _origin_in_words(turn, origin, self.links[0])
        return Kernel(lower.graph, x, parameter_nodes(self.system, lower), forms, frame)

    def attempt(self, axes: CommonAxes, origin: Origin) -> Attempt:
        """Return the number of operations in a common frame, and the frame: its axes and origin."""
        kernel = self.build(axes, origin, gradient=False)
        outputs = [node for forms in kernel.forms for node in forms.decomposition()]
        return count_operations(kernel.graph, outputs).arithmetic, axes, origin

    def framed(self, most_axes: int) -> Iterator[Attempt]:
        """Yield attempts in frames of the longest chain, with own origins, then the best with others."""
        longest = max(self.chains, key=len)
        tried = [self.attempt(axes, Origin(axes.frame)) for axes in _axes(longest, most_axes)]
        yield from tried
        best = min(tried, key=itemgetter(0))[1]
        for frame in _spread([-1, *longest], MAX_ORIGINS):
            if frame != best.frame:
                yield self.attempt(best, Origin(frame))

    def central(self, most_axes: int) -> Iterator[Attempt]:
        """Yield attempts with the origin in the one link's centre of mass; the best axes also by points.

        The link's principal axes are not among them: they make three products zero and the rotations before
        them full, and were the cheapest for none of the robots that they were tried on.
        """
        tried = [self.attempt(axes, Origin()) for axes in _axes(self.chains[0], most_axes)]
        yield from tried
        yield self.attempt(min(tried, key=itemgetter(0))[1], Origin(by_points=True))


def _axes(chain: Sequence[int], most: int) -> Iterator[CommonAxes]:
    """Yield the axes to try: the base's, and those before and behind joints spread over the chain."""
    yield CommonAxes(-1)
    for f in _spread(chain, most):
        yield CommonAxes(f)
        yield CommonAxes(f, before=True)


def _spread(items: Sequence[int], most: int) -> list[int]:
    """Return at most `most` of the items: all of the first few, then spread evenly to the last."""
    if len(items) <= most:
        return list(items)
    near = list(items[: most // 2])
    step = (len(items) - 1 - len(near)) / (most - len(near) - 1)
    return near + [items[round(len(near) + step * k)] for k in range(most - len(near))]


def _axes_in_words(turn: Orientation, axes: CommonAxes) -> str:
    if axes.frame < 0:
        return "the base's"
    joint = turn.labels[axes.frame]
    return (
        f"of the frame before joint {joint} moves"
        if axes.before
        else f"of the frame that joint {joint} moves"
    )


def _origin_in_words(turn: Orientation, origin: Origin, link: RigidLink) -> str:
    if origin.frame is None:
        text = "the link's centre of mass, moving with it"
        number = isinstance(link.mass, (int, float)) and link.mass >= 0
        return f"{text}; lengths are times the square root of its mass, {link.mass!r} kg" if number else text
    if origin.frame < 0:
        return "the base's, at rest"
    return f"where joint {turn.labels[origin.frame]} is at the instant, at rest"
