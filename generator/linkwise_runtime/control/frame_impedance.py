"""Impedance of a frame, which has precedence over that of the joints (the paper's target impedance).

With r rows of the frame's Jacobian J, its velocity nu = J qd, and H, C, f as for joints:

    L = (J H^-1 J')^-1      Jd = H^-1 J' L      F = Jd' f      mu = L (J H^-1 C - dJ/dt) Jd
    M_e (nud - nud_d) + B_e (nu - nu_d) + E' K_e x = F          x = (rotation vector, place) of the error
    qdd = qdd_0 + Jd (nud - dJ/dt qd - J qdd_0)

Under ties H, C, J, f are those of the coordinates that these leave free: G^T H G, G^T (H dG/dt + C G), J G
and G^T f.
L and mu are the frame's natural inertia and velocity forces: dL/dt - 2 mu is skew-symmetric. E maps angular
velocities to rates of the rotation vector. qdd_0 is the acceleration that the joints' targets ask for; see O.
Khatib, A unified approach for motion and force control of robot manipulators, 1987.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..answers.inertia_solve import Told
from ..arguments import kept_numbers
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind, short
from ..constraints.closed_places import times
from ..interface import Library, Namespace, Numbers, namespace
from ..kinematics.frame_answers import FrameAnswers, frame_index
from ..rule.joint_tree import JointTree
from ..targets import ROWS, FrameImpedance, Natural
from .frame_rotation import rates_of_turning, rotation_vector
from .gains import Gain
from .joint_impedance import JointState
from .target_solve import TargetInertia, solve_target

SIX = "turns about and moves along the world's x, y, z, whichever rows are controlled"
OF_FRAME = {
    "pose": ((4, 4), "the matrix that kinematics.pose answers with"),
    "velocity": ((6,), SIX),
    "acceleration": ((6,), SIX),
}
"""Parts of a target that concern a frame: their own axes, and what lies along these."""


class FramePart(NamedTuple):
    """Kept part of the natural matrix, and what is added to it."""

    kept: float
    added: Gain | None

    def of(self, library: Library, natural: Numbers, like: Numbers) -> Numbers:
        """Return the wanted matrix (..., r, r)."""
        kept = natural if self.kept == 1.0 else self.kept * natural
        return kept if self.added is None else kept + self.added.matrix(library, like)


class FrameState(NamedTuple):
    """A frame in motion, by its chosen rows."""

    jacobian: Numbers
    """J (..., r, n)."""
    bias: Numbers
    """dJ/dt qd (..., r)."""
    inertia: Numbers
    """L (..., r, r)."""
    dual: Numbers
    """Jd (..., n, r)."""
    target_inertia: Numbers
    target_damping: Numbers
    rate: Numbers
    """nu - nu_d (..., r)."""
    place: Numbers | None
    """x (..., r); None without stiffness."""
    turning: Numbers | None
    """E (..., r, r); None without stiffness."""
    wanted: Numbers | None
    """nud_d (..., r); None if it is not given."""


class FrameTargets:
    """Targets of one frame, for any motion."""

    def __init__(self, frames: FrameAnswers, asked: FrameImpedance) -> None:
        """Read what is wanted of the frame; raises as `Dynamics.partial_impedance` does."""
        if not isinstance(asked, FrameImpedance):
            frame = short(asked) if isinstance(asked, str | int) else "frame"
            raise TypeError(
                f"frame is {known_kind(asked, FrameImpedance)}; give FrameImpedance({frame}, ...)"
            )
        self.rows, self.names = _chosen(asked.rows), tuple(asked.rows)
        self.frame, self.point = asked.frame, _point(asked.point)
        self.number = frame_index(asked.frame, frames.names)
        self._check_movable(frames.tree)
        self.inertia = self._part("frame.inertia", asked.inertia, True)
        self.damping = self._part("frame.damping", asked.damping, False)
        gain = Gain("frame.stiffness", asked.stiffness, self.names)
        self.stiffness = gain if gain.numbers.any() or gain.learned else None

    @property
    def dissipative(self) -> bool:
        """True if natural inertia and velocity forces are kept alike, and all turns are stiff or none.

        The angle about one axis changes by turns about the others, too.
        """
        turns = sum(row < 3 for row in self.rows)
        return self.inertia.kept == self.damping.kept and (turns in (0, 3) or self.stiffness is None)

    def _check_movable(self, tree: JointTree) -> None:
        """Raise ValueError where fewer joints move the frame than it has rows, wherever they are."""
        moving = tree.chain(tree.frames[self.number].joint)
        joints = {tree.joints[f].coordinate for f in moving}
        if len(joints) < len(self.rows):
            raise ValueError(
                f"frame {self.frame!r} cannot move along {len(self.rows)} rows, each by itself: "
                f"{len(joints)} joint{'s' * (len(joints) != 1)} move it; choose rows, such as rows=('x', 'y')"
            )

    def state(self, backend: ArrayBackend, joints: JointState, given: Mapping[str, Numbers]) -> FrameState:
        """Return the frame's state at q and qd and for a target, which are all in `given` by name."""
        xp, frames, q, qd, freedom = backend.xp, backend.frames, given["q"], given["qd"], joints.freedom
        rows = backend.index(np.array(self.rows, np.intp), q)
        point = backend.constant(self.point, q)
        motion, vectors = (q, qd), {"point": xp.broadcast_to(point, (*q.shape[:-1], 3))}
        whole = frames.answer("jacobian", motion[:1], self.number, vectors)
        j = whole[..., rows, :]
        rate = frames.answer("jacobian_rate", motion, self.number, vectors)[..., rows, :]
        inner = freedom.inner(joints.inertia)
        sizes = inner.diagonal(0, -2, -1)
        vague = Told(
            "the mass matrix is nearly singular",
            freedom.names,
            beside=", and torques for a frame perhaps by fewer digits",
        )
        about = TargetInertia("the mass matrix is not positive", vague)
        along = freedom.projected(xp.swapaxes(j, -1, -2))
        moved = freedom.moved(solve_target(about, inner, along, sizes))
        compliance = j @ moved
        ones = backend.constant(np.eye(len(self.rows)), q) + 0.0 * compliance
        hardly = f"frame {self.frame!r} can hardly move along rows each by itself"
        about = TargetInertia(self._unmovable(), Told(hardly, self.names, of_frame=True))
        inertia = solve_target(about, compliance, ones, _reach(freedom.columns(whole), sizes)[..., rows])
        dual = moved @ inertia
        natural = (inertia @ (xp.swapaxes(moved, -1, -2) @ joints.coriolis - rate)) @ dual
        turned = freedom.rates(dual)
        if turned is not None:
            natural = natural + (inertia @ (xp.swapaxes(moved, -1, -2) @ joints.inertia - j)) @ turned
        place, turning = self._place(backend, q, given.get("target.pose"))
        velocity, wanted = (
            given[name][..., rows] if name in given else None
            for name in ("target.velocity", "target.acceleration")
        )
        speed = times(j, qd)
        return FrameState(
            j,
            times(rate, qd),
            inertia,
            dual,
            self.inertia.of(backend, inertia, q),
            self.damping.of(backend, natural, q),
            speed if velocity is None else speed - velocity,
            place,
            turning,
            wanted,
        )

    def acceleration(
        self, backend: ArrayBackend, state: FrameState, qdd: Numbers, external: Numbers | None
    ) -> Numbers:
        """Return qdd (..., n), nearest to the one given, with which the frame moves as asked."""
        xp = backend.xp
        pull = -times(state.target_damping, state.rate)
        if state.place is not None and state.turning is not None:
            pull = pull - times(xp.swapaxes(state.turning, -1, -2), self._pull(backend, state.place))
        if external is not None:
            pull = pull + times(xp.swapaxes(state.dual, -1, -2), external)
        what = f"the wanted inertia of frame {self.frame!r}"
        vague = Told(f"{what} is nearly singular", self.names, of_frame=True)
        natural = self.inertia.kept * state.inertia.diagonal(0, -2, -1)
        told = self.inertia.added is None  # a share of L is known as well as L
        singular = self._unmovable() if told else f"{what} is not positive"
        about = TargetInertia(singular, vague)
        moved = solve_target(about, state.target_inertia, pull[..., None], natural, told=told)[..., 0]
        if state.wanted is not None:
            moved = moved + state.wanted
        return qdd + times(state.dual, moved - state.bias - times(state.jacobian, qdd))

    def stored(self, backend: ArrayBackend, state: FrameState) -> Numbers:
        """Return the stored energy (nu~' M_e nu~ + x' K_e x) / 2, (...), with nu~ = nu - nu_d."""
        energy = (state.rate * times(state.target_inertia, state.rate)).sum(-1) / 2.0
        if state.place is None:
            return energy
        return energy + (state.place * self._pull(backend, state.place)).sum(-1) / 2.0

    def _unmovable(self) -> str:
        return f"frame {self.frame!r} cannot move along rows each by itself"

    def _pull(self, library: Library, place: Numbers) -> Numbers:
        """Return K_e x (..., r)."""
        assert self.stiffness is not None  # there is no place without it
        return times(self.stiffness.matrix(library, place), place)

    def _place(
        self, backend: ArrayBackend, q: Numbers, wanted: Numbers | None
    ) -> tuple[Numbers | None, Numbers | None]:
        """Return x and E of the chosen rows; None where nothing is stiff."""
        if self.stiffness is None:
            return None, None
        if wanted is None:
            raise ValueError(
                f"frame {self.frame!r} is stiff, but target has no pose; give Target(pose=...), (..., 4, 4), "
                "such as robot.kinematics.pose(q, frame) of where it shall be"
            )
        xp = backend.xp
        point = backend.constant(self.point, q)
        pose = backend.frames.answer("pose", [q], self.number)
        places = [times(m[..., :3, :3], point) + m[..., :3, 3] for m in (pose, wanted)]
        moved = places[0] - places[1]
        if max(self.rows) < 3 or min(self.rows) < 3:
            theta = rotation_vector(backend, pose[..., :3, :3], wanted[..., :3, :3])
        else:
            theta = 0.0 * moved
        rows = backend.index(np.array(self.rows, np.intp), q)
        whole = xp.zeros_like(theta[..., :, None] * theta[..., None, :])
        ones = whole + backend.constant(np.eye(3), q)
        upper = xp.concat([rates_of_turning(backend, theta), whole], -1)
        turning = xp.concat([upper, xp.concat([whole, ones], -1)], -2)
        return xp.concat([theta, moved], -1)[..., rows], turning[..., rows, :][..., rows]

    def _part(self, name: str, given: object, definite: bool) -> FramePart:
        if isinstance(given, Natural):
            if isinstance(given.scale, bool) or not isinstance(given.scale, int | float) or given.scale < 0.0:
                raise ValueError(f"{name}.scale is {given.scale!r}; give a number, 0 or above")
            if given.plus is None:
                return FramePart(float(given.scale), None)
            gain = Gain(f"{name}.plus", given.plus, self.names, symmetric=definite)
            return FramePart(float(given.scale), gain)
        return FramePart(0.0, Gain(name, given, self.names, None, definite, symmetric=definite))


def _reach(jacobian: Numbers, inertia: Numbers) -> Numbers:
    """Return how far joints of these inertias (..., n), each by itself, move a frame, (..., 6).

    The first three numbers are for its turns, the others for its moves.
    """
    xp: Namespace = namespace(jacobian)
    each = (jacobian**2 / inertia[..., None, :]).sum(-1)
    turns, moves = each[..., :3].sum(-1)[..., None], each[..., 3:].sum(-1)[..., None]
    return xp.concat([turns, turns, turns, moves, moves, moves], -1)


def _point(given: object) -> NDArray[np.float64]:
    """Return the point, (3,), in m.

    Raises ValueError for what is not three finite numbers, TypeError for a gradient.
    """
    point = kept_numbers("frame.point", given)
    if point is None or point.shape != (3,):
        raise ValueError(f"frame.point is {short(given)}; give x, y, z in the frame, in m")
    return point


def _chosen(rows: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of rows; raises ValueError for none, and for one that is unknown or given twice."""
    unknown = [row for row in rows if row not in ROWS]
    if unknown or len(set(rows)) < len(rows) or not len(rows):
        raise ValueError(f"frame.rows is {rows!r}; choose some of {', '.join(ROWS)}, each once")
    return tuple(ROWS.index(row) for row in rows)
