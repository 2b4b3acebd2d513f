"""Noise of a log's positions: as a file states it, or as filter and fit took it away.

[motion]
angle = "0.3 deg"            # of each sample of every joint that turns
length = "1 mm"              # of every joint that slides
[motion.joint.elbow]         # of one joint alone
sd = "0.5 deg"
[motion.correlation]         # of these joints' noise
joints = ["shoulder", "elbow"]
matrix = [[1.0, 0.5], [0.5, 1.0]]

or

[motion]
estimate = true              # from what the filter took away

Noise is independent from sample to sample. An estimate takes all that was taken away for such noise: motion
above the cutoff makes it larger, noise that is slower than the cutoff smaller than it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from linkwise_runtime.certainty.uncertain_bodies import checked_correlation

from linkwise.analysis.filtering import derivatives
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.passed_noise import PassedNoise
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.analysis.stated_sd import place_of, stated
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.package.decode import known_keys

ANGLE = {"deg": np.pi / 180.0, "mrad": 1e-3, "rad": 1.0}
LENGTH = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
OF = {"rad": ("angle", ANGLE), "m": ("length", LENGTH)}
"""Key and units of noise, by the unit of a joint's coordinate."""
LONGEST = 1 << 16
"""Most samples from which noise is estimated."""


@dataclass(frozen=True, eq=False)
class StatedNoise:
    """Noise of positions as a file states it; the covariance is None where it is to be estimated."""

    covariance: Array | None
    """Covariance of the noise of one sample of all coordinates (n, n), in rad^2, rad m and m^2."""


@dataclass(frozen=True, eq=False)
class MotionNoise:
    """Noise of the positions of a log, and its passage through filter and derivatives."""

    covariance: Array
    """Covariance of the noise of one sample of all coordinates, (n, n)."""
    passage: PassedNoise
    is_estimated: bool
    first: float
    """Time of the log's first sample in s."""
    rate: float
    joints: tuple[str, ...]
    units: tuple[str, ...]
    followed: tuple[float, ...] = ()
    """Correlation of what was taken away of each joint with the next sample's, where noise is estimated."""

    @property
    def deviations(self) -> Array:
        """Standard deviation of each coordinate's noise, (n,) in rad or m."""
        found: Array = np.sqrt(np.diag(self.covariance))
        return found

    def roots(self, time: Array) -> Array:
        """Return D (S or 1, 3 n, R) at samples, with D D^T the covariance of q, qd and qdd in that order.

        With the root U of the covariance and the triangles L of G, its columns are those of L times those of
        U; the last third changes accelerations alone.
        """
        samples = np.rint((time - self.first) * self.rate).astype(np.intp)
        alike = self.passage.alike(samples)
        if (alike == alike[0]).all():
            alike = alike[:1]
        columns = np.einsum("sxc,rk->sxkcr", self._triangles[alike], self._root)
        found: Array = columns.reshape(len(alike), 3 * len(self.joints), -1)
        return found

    @cached_property
    def _triangles(self) -> Array:
        """Triangles L of the passage, (L, 3, 3)."""
        return lower_triangles(self.passage.gram)

    @cached_property
    def _root(self) -> Array:
        """Rows of U^T with U U^T the covariance, (R, n)."""
        if np.count_nonzero(self.covariance - np.diag(np.diag(self.covariance))) == 0:
            own: Array = np.diag(self.deviations)[self.deviations > 0.0]
            return own
        values, vectors = np.linalg.eigh(self.covariance)
        kept = values > np.finfo(float).eps * values.max(initial=0.0) * len(values)
        found: Array = (vectors[:, kept] * np.sqrt(values[kept])).T
        return found

    def directions(self, time: Array) -> list[tuple[Array, Array, Array]]:
        """Return independent changes of q, qd and qdd (S or 1, n) at samples, of one standard deviation each.

        They are the columns of `roots`.
        """
        n = len(self.joints)
        columns = np.moveaxis(self.roots(time), -1, 0)
        return [(one[:, :n], one[:, n : 2 * n], one[:, 2 * n :]) for one in columns]

    def record(self) -> dict[str, Any]:
        """Return this as plain data: deviations in rad or m."""
        told = zip(self.joints, self.deviations.tolist(), self.units, strict=True)
        sizes = np.where(self.deviations > 0.0, self.deviations, 1.0)
        return {
            "noise": [{"joint": joint, "sd": sd, "unit": unit} for joint, sd, unit in told],
            "correlation": (self.covariance / np.outer(sizes, sizes)).tolist(),
            "estimated_from_what_the_filter_took_away": self.is_estimated,
        }

    @property
    def told(self) -> str:
        """Phrase that says how large noise is, and whence that is known."""
        some = [
            f"{joint} {1e3 * sd:.2g} m{unit}"
            for joint, sd, unit in zip(self.joints, self.deviations.tolist(), self.units, strict=True)
        ]
        more = f" and {len(some) - SHOWN} more" if len(some) > SHOWN else ""
        whence = "from what the filter took away" if self.is_estimated else "as stated"
        return f"noise of positions, {whence}: {', '.join(some[:SHOWN])}{more}"

    @property
    def suspicion(self) -> str:
        """Phrase about joints of which more, or less, than independent noise was taken away; "" without."""
        own = self.passage.followed.sum() / self.passage.removed.sum() if self.followed else 0.0
        least = max(ALIKE, CHANCE / self.passage.samples**0.5)
        apart = [
            (abs(found - own), joint, found)
            for joint, found, sd in zip(self.joints, self.followed, self.deviations, strict=False)
            if sd and abs(found - own) > least
        ]
        if not apart:
            return ""
        _, worst, found = max(apart)
        more = f" and of {len(apart) - 1} more" if len(apart) > 1 else ""
        return (
            f"what the filter took away of {worst}{more} is not noise that is independent from sample to"
            f" sample: it correlates by {found:.2f} with the next sample's, and such noise by {own:.2f};"
            " motion above the cutoff makes deviations larger than they are, slow noise smaller"
        )


SHOWN = 8
"""Joints whose noise a phrase tells."""
ALIKE, CHANCE = 0.1, 4.0
"""Difference of correlations from sample to sample, also as a multiple of one over the root of their number,
from which on noise does not count as independent."""


def read_motion(data: Any, robot: OpenedRobot) -> StatedNoise:
    """Return what the table [motion] says; raise LinkwiseError, which names the key, for what cannot be."""
    place = "[motion]"
    table = known_keys(place, data, ("estimate", "angle", "length", "joint", "correlation"))
    if table.get("estimate", False) is not False:
        if table["estimate"] is not True or len(table) > 1:
            raise LinkwiseError(f"{place}: estimate = true goes alone: it finds the noise of every joint")
        return StatedNoise(None)
    own = _of_joints(table.get("joint", {}), robot)
    found = []
    for name, unit in zip(robot.joints, robot.units, strict=True):
        key, units = OF[unit]
        at, given = (f"[motion.joint.{name}]", own[name]) if name in own else (place, table.get(key))
        found.append(0.0 if given is None else stated(at, "sd" if name in own else key, given, units)[0])
    if not any(found):
        raise LinkwiseError(
            f"{place} states no noise; give angle, length or a joint's sd, or estimate = true"
        )
    sd = np.array(found)
    return StatedNoise(np.outer(sd, sd) * _correlation(table, robot))


def _of_joints(tables: Any, robot: OpenedRobot) -> dict[str, Any]:
    """Return the deviation that each table [motion.joint.NAME] gives."""
    found, known = {}, tables if isinstance(tables, dict) else ()
    for name, table in known_keys("[motion.joint]", tables, known).items():
        place_of(f"[motion.joint.{name}]", "joint", name, robot.joints, robot)
        if "sd" not in known_keys(f"[motion.joint.{name}]", table, ("sd",)):
            raise LinkwiseError(f"[motion.joint.{name}] needs sd")
        found[name] = table["sd"]
    return found


def _correlation(table: Mapping[str, Any], robot: OpenedRobot) -> Array:
    """Return the correlation of all joints' noise, (n, n)."""
    whole, place = np.eye(len(robot.joints)), "[motion.correlation]"
    if "correlation" not in table:
        return whole
    given = known_keys(place, table["correlation"], ("joints", "matrix"))
    names = given.get("joints")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise LinkwiseError(f"{place} needs joints, a list of their names")
    numbers = [place_of(place, "joint", name, robot.joints, robot) for name in names]
    if len(set(numbers)) < len(numbers):
        raise LinkwiseError(f"{place}: joints names one twice; name each once")
    try:
        whole[np.ix_(numbers, numbers)] = checked_correlation(names, given.get("matrix"))
    except ValueError as error:
        raise LinkwiseError(f"{place}: {error}") from None
    return whole


def motion_noise(
    asked: StatedNoise, raw: Array, samples: Samples, processing: Processing, robot: OpenedRobot
) -> MotionNoise:
    """Return the noise of a log, estimated where it is asked for.

    raw: the log's first positions as they were before the filter, at most `LONGEST`; samples: those behind it

    Raises LinkwiseError where nothing was taken away from which noise could be estimated, and for positions
    that were resampled.
    """
    if samples.first_row is None:
        raise LinkwiseError(
            "[motion] is of the log's own positions, and --resample makes others of them whose noise goes"
            " together; leave --resample out"
        )
    passage = PassedNoise.of(len(samples.time), samples.rate, processing)
    covariance, driven, followed = asked.covariance, np.zeros(len(robot.joints)), ()
    driven[list(robot.driven)] = 1.0
    if covariance is None:
        if processing.lowpass is None and processing.derivative != "savitzky-golay":
            raise LinkwiseError(
                "[motion] estimate takes what a filter took away for noise, and nothing was; give --cutoff,"
                " or --derivative savitzky-golay"
            )
        made = derivatives(samples.q, samples.rate, 0, len(raw), processing)[0]
        taken = raw - made
        removed = passage.removed[passage.alike(np.arange(len(raw)))].sum()
        covariance = taken.T @ taken / removed
        sizes = (taken**2).sum(0)
        followed = tuple(((taken[:-1] * taken[1:]).sum(0) / np.where(sizes > 0.0, sizes, 1.0)).tolist())
    covariance = covariance * np.outer(driven, driven)
    first, units = float(samples.time[0]), tuple(robot.units)
    estimated = asked.covariance is None
    names = tuple(robot.joints)
    return MotionNoise(covariance, passage, estimated, first, samples.rate, names, units, followed)


def lower_triangles(matrices: Array) -> Array:
    """Return L with L L^T = each matrix (S, 3, 3), positive semidefinite."""
    found = np.zeros_like(matrices)
    for k in range(3):
        left = matrices[:, k:, k] - np.einsum("sac,sc->sa", found[:, k:, :k], found[:, k, :k])
        pivot = left[:, 0]
        there = pivot > np.finfo(float).eps * 16.0 * np.abs(matrices[:, k, k])
        root = np.sqrt(np.where(there, pivot, 1.0))
        found[:, k:, k] = np.where(there[:, None], left / root[:, None], 0.0)
    return found
