"""Search for the common frame of the rigid-link rule: a few are tried, that of fewest operations is kept."""

from collections.abc import Iterator, Sequence
from operator import itemgetter

from linkwise.dynamics.joint_chain import CommonAxes, JointChain
from linkwise.dynamics.link_forms import LinkForms, lowering
from linkwise.dynamics.link_motion import Origin
from linkwise.dynamics.rigid_link import rigid_forms
from linkwise.symbolic.system import RigidSystem

MAX_AXES, MAX_ORIGINS = 4, 3

Attempt = tuple[int, CommonAxes, Origin]


class FrameSearch:
    """Search for a common frame for a link of a system, by the cost of its decomposition."""

    def __init__(self, system: RigidSystem, link: int) -> None:
        self.system, self.link = system, system.links[link]
        self.frames = range(1, len(self.link.joints) + 1)

    def build(self, axes: CommonAxes, origin: Origin, gradient: bool = True) -> LinkForms:
        """Return the closed forms in a common frame, with or without the position gradient."""
        lower, x = lowering(self.system)
        chain = JointChain(lower, self.link.joints, self.system.robot.gravity, axes, x)
        frame = _axes_in_words(chain, axes), self._origin_in_words(chain, origin)
        return rigid_forms(chain, self.link, origin, frame, gradient)

    def attempt(self, axes: CommonAxes, origin: Origin) -> Attempt:
        """Return the number of operations in a common frame, and the frame: its axes and origin."""
        return self.build(axes, origin, gradient=False).decomposition_cost, axes, origin

    def framed(self, most_axes: int) -> Iterator[Attempt]:
        """Yield attempts in frames of the chain, with own origins, then the best with others."""
        tried = [self.attempt(axes, Origin(axes.frame)) for axes in self._axes(most_axes)]
        yield from tried
        best = min(tried, key=itemgetter(0))[1]
        for frame in _spread([0, *self.frames], MAX_ORIGINS):
            if frame != best.frame:
                yield self.attempt(best, Origin(frame))

    def central(self, most_axes: int) -> Iterator[Attempt]:
        """Yield attempts with the origin in the link's centre of mass; the best axes also by points.

        The link's principal axes are not among them: they make three products zero and the rotations before
        them full, and were the cheapest for none of the robots that they were tried on.
        """
        tried = [self.attempt(axes, Origin()) for axes in self._axes(most_axes)]
        yield from tried
        yield self.attempt(min(tried, key=itemgetter(0))[1], Origin(by_points=True))

    def _axes(self, most: int) -> Iterator[CommonAxes]:
        """Yield the axes to try: the base's, and those before and behind joints spread over the chain."""
        yield CommonAxes(0)
        for f in _spread(self.frames, most):
            yield CommonAxes(f)
            yield CommonAxes(f, before=True)

    def _origin_in_words(self, chain: JointChain, origin: Origin) -> str:
        if origin.frame is None:
            mass, text = self.link.mass, "the link's centre of mass, moving with it"
            scaled = isinstance(mass, (int, float)) and mass >= 0
            scale = f"; lengths are multiplied by the square root of its mass, {mass!r} kg"
            return text + scale if scaled else text
        if origin.frame == 0:
            return "the base's, at rest"
        return f"where joint {chain.label[origin.frame]} is at the instant, at rest"


def _axes_in_words(chain: JointChain, axes: CommonAxes) -> str:
    if axes.frame == 0:
        return "the base's"
    joint = chain.label[axes.frame]
    return (
        f"of the frame before joint {joint} moves"
        if axes.before
        else f"of the frame that joint {joint} moves"
    )


def _spread(items: Sequence[int], most: int) -> list[int]:
    """Return at most `most` of the items: all of the first few, then spread evenly to the last."""
    if len(items) <= most:
        return list(items)
    near = list(items[: most // 2])
    step = (len(items) - 1 - len(near)) / (most - len(near) - 1)
    return near + [items[round(len(near) + step * k)] for k in range(most - len(near))]
