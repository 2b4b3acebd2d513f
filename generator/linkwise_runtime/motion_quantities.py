"""Quantities of a motion as a whole."""

from typing import Any, Generic, NamedTuple

from .chosen_names import choice, short
from .interface import Array


class TracedMotion(NamedTuple, Generic[Array]):
    """Velocities of a motion by the sources that gave them: parts v_s that sum to qd.

    Source s is one of X, by its name, and w one of W windows of time in which it acted:

        torque:JOINT             the actuator of a joint, by its torque
        gravity                  weight; by link gravity:LINK
        share:NAME               in place of it, what links written by hand have beside motion, by its name
        spring:JOINT, damping:JOINT, friction:JOINT
        load:NAME                a load from outside
        residual                 what the motion needs and no source gives, where torques are given
        start                    the velocities at the start, which no force of this motion made

    Under constraints the joints of the actuators and of `coriolis` are the m independent ones; else m is n.
    """

    time: Array
    """Instants (T,), in s."""
    velocity: Array
    """v_s of all joints, (T, ..., n, X, W), in rad/s or m/s."""
    energy: Array
    """1/2 v_s^T M v_s (T, ..., X, W), in J, which no other source changes. The whole kinetic energy has
    v_s^T M v_r of each two parts besides."""
    power: Array
    """F_s^T v_s (T, ..., X, W), in W: the rate of that energy."""
    work: Array
    """Integral of the power since the start (T, ..., X, W), in J."""
    coriolis: Array
    """C (T, ..., m, m), for `velocity_torque`."""
    sources: tuple[str, ...]
    """Names of the sources."""
    windows: tuple[tuple[float, float], ...]
    """Begin and end of each window, in s."""
    coordinates: tuple[int, ...]
    """Indices of the m joints of the equations of motion."""

    @property
    def total(self) -> Array:
        """Sum over all sources, (T, ..., n): qd."""
        total: Array = self.velocity.sum((-2, -1))
        return total

    @property
    def velocity_torque(self) -> Array:
        """Velocity torques by origin, (T, ..., m, m, X, W), in N m or N: C_ik v_sk on joint i.

        Of what the velocity of joint k asks of joint i, it is the part that goes back to source s. The sum
        over k, X and W is C qd.
        """
        own: Array = self.velocity[..., list(self.coordinates), :, :]
        torque: Array = self.coriolis[..., None, None] * own[..., None, :, :, :]
        return torque

    # Any: in a NamedTuple mypy refuses a method whose arguments are of the same kind as `self`.
    def of(self: "TracedMotion[Any]", source: str, values: Any = None) -> Any:
        """Return the part of a source, or of all of one kind, summed over windows.

        source: a name, such as "torque:elbow", or its first part, such as "torque", for all of them
        values: one of the arrays here, with axes (..., X, W); `velocity` unless given

        Raises ValueError for a source that is not there.
        """
        asked = self.velocity if values is None else values
        return asked[..., self.places(source), :].sum((-2, -1))

    def places(self: "TracedMotion[Any]", source: str) -> list[int]:
        """Return the indices of a source along the axis X, or of all of one kind.

        Raises ValueError for a source that is not there.
        """
        if source in self.sources:
            return [self.sources.index(source)]
        found = [s for s, name in enumerate(self.sources) if name.startswith(f"{source}:")]
        if not found:
            raise ValueError(
                f"no source {short(source)} moves this robot; choose a source: "
                f"{choice(str(source), self.sources, 'sources')}"
            )
        return found


class Counterfactual(NamedTuple, Generic[Array]):
    """A motion as it would have been without one of its sources, all else as it was."""

    time: Array
    """Instants (T,), in s."""
    q: Array
    """Positions without the source (T, ..., n), in rad or m, by simulation."""
    qd: Array
    """Velocities there, in rad/s or m/s."""
    first_order_q: Array
    """Positions without the source (T, ..., n) to first order: the motion, and what leaving out a small part
    of the source changes, in proportion."""
    first_order_qd: Array
    """Velocities to first order."""
    drift: Array
    """Positions of a simulation with the source, less those of the motion, (T, ..., n): what to trust."""
