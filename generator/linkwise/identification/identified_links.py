"""`identify`: the parameters of a robot's links, from a log."""

from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path

from linkwise_runtime.certainty.random_motions import Motion, random_closed_motion, random_motion

from linkwise.analysis.covariance_table import link_parameters
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.settings import Processing, Reading, pairs
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.identification.base_parameters import BaseParameters, base_parameters, samples_needed
from linkwise.identification.bearings import Bearings
from linkwise.identification.fit import WORST, Excitation, excitation, weighted_fit
from linkwise.identification.identification_result import Identification
from linkwise.identification.log_warnings import doubts, noisy_positions
from linkwise.identification.normal_factors import JointEquations, joint_equations
from linkwise.identification.physical_fit import physical_fit
from linkwise.identification.torque_log import TorqueLog, read_torque_log
from linkwise.identification.uncertain_robot import read_prior
from linkwise.option import option
from linkwise.progress import Progress, silent


@dataclass(frozen=True)
class Fitting:
    """Choice of what is fitted: the log's torque columns, as (column, joint) pairs, and how they are fitted.

    factor: brings torques to N m, and forces to N
    friction: whether friction is fitted
    unseen: share of the log, at its end, that is left out of the fit and predicted by it
    unmeasured: joints with unknown torques, such as coordinates of a floating base, on which the ground acts

    Raises LinkwiseError for values that are not possible.
    """

    torques: tuple[tuple[str, str], ...] = option(
        (),
        "Column of a joint's torque; may be repeated",
        "--torque",
        metavar="COLUMN=JOINT",
        read=partial(pairs, "--torque"),
    )
    factor: float = option(
        1.0, "What brings torques to N m and forces to N: 0.001 for N mm", "--torque-factor"
    )
    friction: bool = option(True, "Viscous and Coulomb friction")
    unseen: float = option(0.2, "Share of the log, its end, to predict and not to fit")
    unmeasured: tuple[str, ...] = option((), "Joint without a torque; may be repeated", metavar="JOINT")

    def __post_init__(self) -> None:
        if not 0 <= self.unseen <= 0.9:
            raise LinkwiseError(f"--unseen {self.unseen:g}: give a share of the log from 0 to 0.9")
        if not 0 < abs(self.factor) < float("inf"):
            raise LinkwiseError(f"--torque-factor {self.factor:g}: give a number that is not 0")


def identify(
    log: str | Path,
    robot: str | PathLike[str] | OpenedRobot,
    reading: Reading | None = None,
    processing: Processing | None = None,
    fitting: Fitting | None = None,
    progress: Progress = silent,
    uncertain: str | PathLike[str] | None = None,
) -> Identification:
    """Identify a robot's links from a log of motion and torques.

    robot: the directory of its package; `linkwise.kept_package` makes one from a robot's file
    uncertain: file of how uncertain the bodies of the package are, which tells how certain those are that are
    identified, where torques do not tell; the fit itself does not use it

    Velocities and accelerations come from positions, as in `analyze`; torques are used as they are.
    Raises LinkwiseError, in one line that names the fix, for what cannot be identified.
    """
    loaded = robot if isinstance(robot, OpenedRobot) else load_robot(Path(robot))
    own = _own_parameters(loaded)
    prior = None if uncertain is None else read_prior(Path(uncertain), loaded)
    reading, processing, fitting = reading or Reading(), processing or Processing(), fitting or Fitting()
    torques = fitting.torques, fitting.unmeasured, fitting.factor
    read = read_torque_log(Path(log), loaded, reading, processing, *torques, progress)
    motion = _random_motion(loaded, read)
    base = base_parameters(loaded.model, read.measured, motion)
    bearings = Bearings.of(loaded, read.measured, motion, fitting.friction)
    end = read.stop - round(fitting.unseen * (read.stop - read.start))
    seen, unseen = (
        joint_equations(read, span, bearings, base, processing, progress)
        for span in ((read.start, end), (end, read.stop))
    )
    noisy = noisy_positions(read, loaded.joints, loaded.units, processing)
    with within(str(log)):
        _refuse_few(seen, base, bearings)
        _refuse_unexcited(excitation(seen, base, bearings), base, noisy)
        fit = weighted_fit(seen, base, bearings)
        physical = physical_fit(fit, base, own, bearings.rubs)
    found = Identification(
        loaded, read, base, bearings, fit, physical, own, seen, unseen, read.warnings, prior
    )
    return replace(found, warnings=(*read.warnings, *doubts(found, noisy)))


def _random_motion(robot: OpenedRobot, read: TorqueLog) -> Motion:
    samples = samples_needed(robot.model, len(robot.driven))
    if robot.constrained is None:
        return random_motion(len(robot.joints), samples)
    return random_closed_motion(robot.constrained.constraints, read.q[read.start : read.stop], samples)


def _own_parameters(robot: OpenedRobot) -> Array:
    if (tree := robot.tree) is None:
        raise LinkwiseError(f"{robot.name} is made of energies; only rigid links have parameters to identify")
    if curved := [robot.joints[joint.coordinate] for joint in tree.joints if joint.curve]:
        raise LinkwiseError(
            f"joint {curved[0]!r} of {robot.name} moves axes by curves, and a URDF file, as identified links "
            "are written, has none; lock it"
        )
    model = robot.model if robot.constrained is None else robot.constrained.open
    if not hasattr(model, "regressor") or model.backend.rule is None:
        raise LinkwiseError(f"{robot.name} has no back end with regressors; {robot.package.remedy}")
    return link_parameters(tree)


def _refuse_few(seen: JointEquations, base: BaseParameters, bearings: Bearings) -> None:
    if not seen.sizes().any():
        raise LinkwiseError("every torque is 0 throughout, which tells nothing; see the columns")
    unknowns = base.count + 2 * int(bearings.rubs.sum())
    if seen.rows * len(seen.triangles) < 2 * unknowns:
        raise LinkwiseError(
            f"{seen.rows} samples are too few for {unknowns} unknowns; give a longer log, or lower --unseen"
        )


def _refuse_unexcited(found: Excitation, base: BaseParameters, noisy: str) -> None:
    """Raise LinkwiseError for a condition number that is far too large."""
    if found.condition <= WORST * base.condition:
        return
    raise LinkwiseError(
        noisy
        or f"too little excitation: the log does not tell {found.worst} from the rest (condition number "
        f"{found.condition:.1g}, {base.condition:.1g} for random motions); record a motion in which every "
        "joint moves far and fast, in many postures"
    )
