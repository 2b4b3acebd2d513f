"""Motion and given forces between the samples of a log.

Velocities go from sample to sample by the cubic that has the accelerations of the samples as slopes, and
accelerations are its slope, so that causes sum to the velocities of the samples. Positions go likewise by the
velocities. What is given sample by sample goes by cubics with the slopes of parabolas through three samples.
"""

from typing import NamedTuple

from ..interface import Numbers, namespace


class SampledMotion(NamedTuple):
    """Motion of T samples, and forces given with it."""

    time: Numbers
    """Instants (T,), in s."""
    steps: Numbers
    """Time from each sample to the next, (T,), in s, which single precision would lose in the difference of
    late instants; anything for the last one."""
    q: Numbers
    """(T, ..., n)"""
    qd: Numbers
    qdd: Numbers
    given: Numbers
    """Columns of forces (T, ..., n, Y)."""
    slopes: Numbers
    """Rates of these columns, (T, ..., n, Y)."""

    def some(self, begin: int, end: int) -> "SampledMotion":
        """Return the samples from `begin` up to, but not including, `end`."""
        return SampledMotion(*(a[begin:end] for a in self))

    @property
    def lengths(self) -> Numbers:
        """Lengths of the steps, (T - 1,), in s."""
        return self.steps[:-1]

    def within_steps(self, part: float) -> "SampledMotion":
        """Return motion and forces at a part of each step's length, T - 1 samples."""
        own = self.lengths.reshape(-1, *[1] * (self.q.ndim - 1))
        wide = own[..., None]
        q, _ = cubic(part, own, self.q, self.qd)
        qd, qdd = cubic(part, own, self.qd, self.qdd)
        given, slopes = cubic(part, wide, self.given, self.slopes)
        time = self.time[:-1] + part * self.lengths
        return SampledMotion(time, self.lengths, q, qd, qdd, given, slopes)


def sample_slopes(lengths: Numbers, values: Numbers) -> Numbers:
    """Return slopes (T, ...) of the parabolas through each sample and those beside it; of lines for two.

    lengths: time from each sample to the next, (T - 1,), in s
    """
    xp = namespace(values)
    h = lengths.reshape(-1, *[1] * (values.ndim - 1))
    steep = (values[1:] - values[:-1]) / h
    if len(steep) == 1:
        return xp.concat([steep, steep], 0)
    before, after = h[:-1], h[1:]
    middle = (after * steep[:-1] + before * steep[1:]) / (before + after)
    first = 2.0 * steep[:1] - middle[:1]
    last = 2.0 * steep[-1:] - middle[-1:]
    return xp.concat([first, middle, last], 0)


def cubic(s: float, h: Numbers, values: Numbers, slopes: Numbers) -> tuple[Numbers, Numbers]:
    """Return the cubics with these values and slopes at their ends, at a part s of each, and their slopes."""
    begin, rise = values[:-1], values[1:] - values[:-1]
    u, v = h * slopes[:-1], h * slopes[1:]
    # Powers of s: begin + u s + (3 rise - 2 u - v) s^2 + (u + v - 2 rise) s^3
    square, cube = 3.0 * rise - 2.0 * u - v, u + v - 2.0 * rise
    return begin + s * (u + s * (square + s * cube)), (u + s * (2.0 * square + 3.0 * s * cube)) / h
