"""Warnings about a log after the fit, each in one line that says what to do.

Causes come before their effects: noise of positions makes a motion look poor and bodies not fit, a wrong sign
makes bodies not fit.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from linkwise.analysis.filtering import derivatives
from linkwise.analysis.passed_noise import PassedNoise
from linkwise.analysis.settings import Processing
from linkwise.arrays import Array
from linkwise.escape import listed
from linkwise.identification.fit import POOR
from linkwise.identification.identification_result import Identification
from linkwise.identification.normal_factors import JointEquations
from linkwise.identification.position_noise import LONGEST
from linkwise.identification.torque_log import TorqueLog

LARGE = 100.0
"""Factor by which torques larger, or smaller, than the robot's own are perhaps in another unit."""
NOISY = 0.2
"""Share of noise in an acceleration that lowers the inertia found by some 4 %."""
UNEXPLAINED = 0.7
"""Share of a joint's torque that, left unexplained, is half of its mean square."""
OPPOSITE = -0.5
"""Correlation of a torque with the robot's own."""
WORSE, SHARE = 2.0, 0.1
"""Multiple of the fit's error, and share of the torque: feasible bodies alone do not cost larger errors."""


def noisy_positions(log: TorqueLog, joints: Sequence[str], units: Sequence[str], how: Processing) -> str:
    """Return a warning where noise makes up much of an acceleration; "" where it does not."""
    stop = min(log.stop, log.start + LONGEST)
    found = np.sqrt(np.mean(derivatives(log.q, log.rate, log.start, stop, how)[2] ** 2, axis=0))
    passed = PassedNoise.of(len(log.q), log.rate, how)
    made = log.noise * np.sqrt(passed.covariance(np.array([len(log.q) // 2]))[0, 2, 2])
    shares = made / np.where(found > 0, found, np.inf)
    at = int(shares.argmax())
    if shares[at] <= NOISY:
        return ""
    many = int((shares > NOISY).sum()) - 1
    whose = repr(joints[at]) + (f" and {many} more" if many else "")
    remedy = "pass --cutoff, in Hz, a little above the motion's own frequencies"
    if how.lowpass is not None:
        remedy = f"lower --cutoff {how.lowpass.cutoff:g} towards the motion's own frequencies"
    unit = units[at]
    return (
        f"the positions of {whose} are noisy: {log.noise[at]:.1g} {unit} of noise, differentiated, is "
        f"{made[at]:.2g} of the {found[at]:.2g} {unit}/s^2 of acceleration (root mean squares); {remedy}"
    )


def doubts(found: Identification, noisy: str) -> Iterator[str]:
    """Yield all warnings but the log's own; `noisy` is the warning of `noisy_positions`."""
    if noisy:
        yield noisy
        return
    yield from _poor(found)
    # Each of these can cause those after it.
    for cause in (_still, _units, _opposite, _unexplained, _impossible):
        if told := tuple(cause(found)):
            yield from told
            return


def _still(found: Identification) -> Iterator[str]:
    still = found.seen.sizes() == 0
    if still.any():
        names = [joint for joint, none in zip(found.joints, still, strict=True) if none]
        yield (
            f"the torque of {listed(map(repr, names))} is 0 throughout, and is fitted as such; where nothing "
            f"measured it, pass --unmeasured {names[0]}{' and so on' if len(names) > 1 else ''}"
        )


def _poor(found: Identification) -> Iterator[str]:
    if found.fit.condition > POOR * found.base.condition:
        yield (
            f"little excitation: the condition number is {found.fit.condition:.3g}, "
            f"{found.base.condition:.3g} for random motions; see the standard errors, or record a motion in "
            "which every joint moves far and fast"
        )


def _units(found: Identification) -> Iterator[str]:
    """Yield a warning where torques are not of the size that the package expects."""
    expected, sizes = _expected(found)[0], found.seen.sizes()
    at = int(np.argmax(sizes))
    if sizes[at] and expected[at] and not 1 / LARGE < sizes[at] / expected[at] < LARGE:
        yield (
            f"the torque of {found.joints[at]!r} is {sizes[at]:.3g} (root mean square) where the robot, as "
            f"it is, needs {expected[at]:.3g}: if it is in another unit, pass --torque-factor, 0.001 for N mm"
        )


def _opposite(found: Identification) -> Iterator[str]:
    correlation = _expected(found)[1]
    against = correlation < OPPOSITE
    if not against.any():
        return
    if len(against) > 1 and not (correlation > -OPPOSITE).any() and 2 * against.sum() >= len(against):
        what, remedy = "torques are", "if the log counts them so, pass --torque-factor -1"
    else:
        names = [joint for joint, is_so in zip(found.joints, against, strict=True) if is_so]
        what, remedy = (
            f"torque of {listed(map(repr, names))} is",
            "see its column, and turn its sign if it is so",
        )
    yield (
        f"the {what} opposite to what the robot, as it is, needs (correlation "
        f"{correlation.min():.2f}): {remedy}; or the robot stands otherwise than its gravity says"
    )


def _unexplained(found: Identification) -> Iterator[str]:
    equations = found.unseen if found.unseen.rows else found.seen
    left, sizes = found.errors(equations)["fit"], equations.sizes()
    names = [
        f"{joint!r} ({error:.3g} of {size:.3g})"
        for joint, error, size in zip(found.joints, left, sizes, strict=True)
        if error > UNEXPLAINED * size > 0
    ]
    if names:
        yield (
            f"no parameters explain the torque of {listed(names)}, most of which is left (root mean squares)"
            ": noise, another joint's column, or a motion that asks for less torque than there is noise"
        )


def _impossible(found: Identification) -> Iterator[str]:
    errors, sizes = found.errors(found.seen), found.seen.sizes()
    by_fit, by_bodies = errors["fit"], errors["bodies"]
    far = (by_bodies > WORSE * by_fit) & (by_bodies > SHARE * sizes)
    if far.any():
        at = int(np.argmax(np.where(far, by_bodies, 0.0)))
        yield (
            "no bodies that can exist explain these torques as the base parameters do: of "
            f"{found.joints[at]!r} they leave {by_bodies[at]:.3g}, those {by_fit[at]:.3g} (root mean squares)"
            "; see the signs, units and order of the torques, and that they are of this robot"
        )


def _expected(found: Identification) -> tuple[Array, Array]:
    """Return the package's torque for each joint, (n,): root mean square, and correlation with the log's."""
    beta = found.base.combinations @ found.own.reshape(-1)
    count = len(beta)
    # Y beta is the error of the equations without their torque.
    bare = JointEquations(found.seen.triangles.copy(), found.seen.rows)
    bare.triangles[:, :, -1] = 0.0
    expected, sizes = bare.errors(beta, np.zeros_like(found.fit.friction)), found.seen.sizes()
    products = [(t[:, :count] @ beta) @ t[:, -1] for t in found.seen.triangles]
    both = expected * sizes * found.seen.rows
    return expected, np.array(products) / np.where(both > 0, both, np.inf)
