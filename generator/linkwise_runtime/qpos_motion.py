"""Conversion of positions, velocities, accelerations and torques of MuJoCo and Pinocchio to coordinates q.

Both have the angular velocity of a body that turns along its own axes. The linear velocity of a body that
floats is along the world's axes in MuJoCo, along the body's in Pinocchio; accelerations are the rates of
these numbers. Torques keep the power: tau^T qd = tau_v^T v.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, SupportsInt

import numpy as np

from .arguments import as_array
from .chosen_names import plain, sample_of, short
from .file_joints import (
    COORDINATES,
    POSITIONS,
    FileJoint,
    Floats,
    angles_of,
    continued,
    in_given_order,
    layout,
    positions_of,
    rates_map,
    rates_of,
    turned,
    turning_of_rates,
)

UNIT = 1e-2
"""Tolerance of the length, 1, of a quaternion, or of a cosine and a sine."""
STEEP = 0.05
"""Cosine of a pitch next to a right angle, some 3 degrees away."""
UPRIGHT = 1e-6
"""Cosine of a pitch at which yaw and roll have no rates."""


class QposMotion(NamedTuple):
    """Converted motion, arrays (..., n) in SI units; None for what was not given."""

    q: Floats
    qd: Floats | None
    qdd: Floats | None
    tau: Floats | None
    warnings: tuple[str, ...]


class Earlier(NamedTuple):
    """Samples before the given ones, where a motion is converted piece by piece."""

    samples: int = 0
    q: Floats | None = None
    """Positions at the last of them, (n,)."""


NOTHING = Earlier()


class _JointNumbers(NamedTuple):
    """A joint, and the places of its numbers in a qpos and in velocities."""

    joint: FileJoint
    positions: slice
    velocities: slice


class Qpos:
    """Conversion of numbers in the order of one simulator to coordinates."""

    def __init__(
        self,
        joints: Sequence[FileJoint],
        order: object = "mujoco",
        names: Sequence[str] | None = None,
    ) -> None:
        """Set up the conversion.

        names: those of the joints in the order of qpos, if it is another.

        Raises ValueError for another order, for names that are not those of the joints, and for a joint of
        which some coordinates are locked.
        """
        if not isinstance(order, str) or order not in POSITIONS:
            raise ValueError(f"order is {short(order)}; choose {' or '.join(POSITIONS)}")
        own = joints if order == "mujoco" else sorted(joints, key=lambda joint: joint.pinocchio)
        self.order, self.joints = order, own if names is None else in_given_order(joints, names)
        for joint in self.joints:
            if len(joint.coordinates) < COORDINATES[joint.kind]:
                raise ValueError(
                    f"of the {joint.kind} joint {plain(joint.name)} some coordinates are locked or follow, "
                    "so that a quaternion is none of what is left; generate the robot without that"
                )
        self.n, self.width = sum(len(j.coordinates) for j in joints), positions_of(joints, order)

    def motion(
        self,
        qpos: object,
        qvel: object = None,
        qacc: object = None,
        tau: object = None,
        earlier: Earlier = NOTHING,
    ) -> QposMotion:
        """Return the motion as `Dynamics.from_qpos` does.

        earlier: samples before these, from which angles, and the numbers of samples in messages, continue
        """
        if qacc is not None and qvel is None:
            raise ValueError("qacc is given without qvel, on which accelerations of angles depend; give both")
        positions = self._read("qpos", qpos, self.width)
        shape = positions.shape[:-1]
        others = {"qvel": qvel, "qacc": qacc, "tau": tau}
        read = [None if x is None else self._read(name, x, self.n, shape) for name, x in others.items()]
        v, a, f = (None if x is None else np.empty_like(x) for x in read)
        found = QposMotion(np.empty((*shape, self.n)), v, a, f, ())
        warnings: list[str] = []
        for part in self._parts():
            at = list(part.joint.coordinates)
            own = [None if x is None else x[..., part.velocities] for x in read]
            before = None if earlier.q is None else earlier.q[at]
            piece = _Piece(part.joint, self.order, before, earlier.samples, warnings)
            made = _converted(piece, positions[..., part.positions], own)
            for into, values in zip(found[:4], made, strict=True):
                if into is not None and values is not None:
                    into[..., at] = values
        return found._replace(warnings=tuple(warnings))

    def why_not(self, width: int) -> str:
        """Return in words what a qpos has, for positions with another number of columns, `width`."""
        other = next((o for o in POSITIONS if positions_of(self.joints, o) == width), None)
        hint = f"; in {other}'s it would have {width}" if other not in (None, self.order) else ""
        return (
            f"in {self.order}'s order its last axis must be {self.width}: {layout(self.joints, self.order)}"
            f"{hint}; joints that are locked, or follow others, have none"
        )

    def _parts(self) -> Iterator[_JointNumbers]:
        at_q = at_v = 0
        for joint in self.joints:
            next_q, next_v = at_q + POSITIONS[self.order][joint.kind], at_v + COORDINATES[joint.kind]
            yield _JointNumbers(joint, slice(at_q, next_q), slice(at_v, next_v))
            at_q, at_v = next_q, next_v

    def _read(self, name: str, given: object, width: int, shape: tuple[int, ...] | None = None) -> Floats:
        values = as_array(name, given)
        if values.dtype.kind not in "fiu":
            raise TypeError(f"{name} has dtype {values.dtype}; give numbers")
        if values.ndim == 0 or values.shape[-1] != width or shape not in (None, values.shape[:-1]):
            raise ValueError(
                f"{name} has shape {values.shape}; {self._wanted(name, values.shape, width, shape)}"
            )
        return values.astype(np.float64)

    def _wanted(self, name: str, given: tuple[int, ...], width: int, shape: tuple[int, ...] | None) -> str:
        if given[-1:] == (width,):
            return f"qpos has {shape} samples; give as many"
        if name != "qpos":
            return f"its last axis must be {width}, one for each degree of freedom"
        return self.why_not(given[-1] if given else 0)


class _Piece(NamedTuple):
    """A joint, the simulator whose numbers are given for it, and its motion before."""

    joint: FileJoint
    order: str
    before: Floats | None
    """Coordinates of the joint at the sample before the first."""
    samples: int
    warnings: list[str]

    def at(self, place: Sequence[SupportsInt]) -> str:
        """Return in words which of all samples this is."""
        return sample_of([*map(int, place[:-1]), *(self.samples + int(last) for last in place[-1:])])


Given = Sequence[Floats | None]
"""Velocities, accelerations and torques of one joint, None for what was not given."""


def _converted(piece: _Piece, p: Floats, given: Given) -> tuple[Floats | None, ...]:
    """Return the coordinates of one joint, and their velocities, accelerations and torques if given."""
    kind, is_mujocos = piece.joint.kind, piece.order == "mujoco"
    if kind == "single" or (is_mujocos and kind in ("continuous", "planar")):
        return (p, *given)
    if kind in ("continuous", "planar"):
        return _in_plane(piece, p, given)
    q = _angles(piece, p[..., -4:] if is_mujocos else p[..., [-1, -4, -3, -2]])
    _say_steepness(piece, q, given)
    if kind == "ball":
        return (q, *_turning(q, given))
    return (np.concatenate([p[..., :3], q], -1), *_floating(q, given, not is_mujocos))


def _in_plane(piece: _Piece, p: Floats, given: Given) -> tuple[Floats | None, ...]:
    """Return the motion of a joint of Pinocchio's whose angle is a cosine and a sine.

    The numbers of a planar one are along the body's axes.
    """
    cosine, sine = p[..., -2], p[..., -1]
    _check_unit(piece, np.hypot(cosine, sine), "a cosine and a sine")
    angle = np.arctan2(sine, cosine)[..., None]
    if piece.before is not None:
        angle = np.unwrap(np.concatenate([piece.before[None, -1:], angle]), axis=0)[1:]
    elif angle.ndim > 1:
        angle = np.unwrap(angle, axis=-2)
    if piece.joint.kind == "continuous":
        return (angle, *given)
    v, a, f = given
    still = np.zeros_like(angle)
    yaw = np.concatenate([angle, still, still], -1)

    def along(values: Floats) -> Floats:
        flat = np.concatenate([values[..., :2], still], -1)
        return np.concatenate([turned(yaw, flat)[..., :2], values[..., 2:]], -1)

    if a is not None and v is not None:  # as the body's axes turn
        a = a + np.stack([-v[..., 2] * v[..., 1], v[..., 2] * v[..., 0], 0.0 * v[..., 2]], -1)
    q = np.concatenate([p[..., :2], angle], -1)
    return (q, *(None if x is None else along(x) for x in (v, a, f)))


def _floating(q: Floats, given: Given, is_local: bool) -> tuple[Floats | None, ...]:
    """Return the velocities, accelerations and torques of x, y, z and the angles q."""
    v, a, f = given
    if is_local and a is not None and v is not None:
        a = np.concatenate([a[..., :3] + np.cross(v[..., 3:], v[..., :3]), a[..., 3:]], -1)
    turning = _turning(q, [None if x is None else x[..., 3:] for x in given])
    moving = (None if x is None else x[..., :3] for x in (v, a, f))
    return tuple(
        None if x is None or turns is None else np.concatenate([turned(q, x) if is_local else x, turns], -1)
        for x, turns in zip(moving, turning, strict=True)
    )


def _turning(q: Floats, given: Given) -> tuple[Floats | None, ...]:
    """Return the first and second rates of angles q, and the torques that do the same work on them."""
    v, a, f = given
    rates = None if v is None else rates_of(q, v)
    changes = torque = None
    if a is not None and rates is not None:
        changes = rates_of(q, a - turning_of_rates(q, rates))
    if f is not None:
        torque = (np.swapaxes(rates_map(q), -1, -2) @ f[..., None])[..., 0]
    return rates, changes, torque


def _angles(piece: _Piece, quaternion: Floats) -> Floats:
    size = np.sqrt((quaternion * quaternion).sum(-1))
    _check_unit(piece, size, "a quaternion")
    angles = angles_of(quaternion / size[..., None])
    if angles.ndim == 1:
        return angles
    return continued(angles, None if piece.before is None else piece.before[-3:])


def _check_unit(piece: _Piece, size: Floats, what: str) -> None:
    """Raise ValueError for the first sample at which numbers that must have length 1 have another."""
    wrong = np.argwhere(~(np.abs(size - 1.0) <= UNIT))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        raise ValueError(
            f"qpos has {what} of length {size[place]:.3g} for {plain(piece.joint.name)}{piece.at(place)}, "
            "and it must be 1; look whether these numbers are qpos, and of which order"
        )


def _say_steepness(piece: _Piece, q: Floats, given: Given) -> None:
    """Warn where yaw and roll are about nearly the same axis; raise ValueError where they have no rates."""
    level = np.abs(np.cos(q[..., 1]))
    if not level.size or not level.min() < STEEP:
        return
    place = np.unravel_index(int(level.argmin()), level.shape)
    name, where = piece.joint.name, piece.at(place)
    if level.min() < UPRIGHT and any(x is not None for x in given):
        raise ValueError(
            f"{plain(name)} is pitched by 90 degrees{where}, where yaw and roll are one turn and have no "
            "rates; cut the motion there, or let the robot's file turn that link otherwise"
        )
    piece.warnings.append(
        f"{plain(name)} comes within {np.degrees(np.arcsin(level.min())):.2g} degrees of a pitch of 90{where}"
        ": yaw and roll turn about nearly the same axis there, and their rates are large"
    )
