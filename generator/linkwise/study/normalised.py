"""Results of trials normalised by who they are of: per kg, or in % of body weight and height.

The tables of trials keep N·m, N, W and J, as the robot bears them; what trials say together is normalised.
Body weight is mass times standard gravity. Masses are those of the study's table of subjects, else of the
trial's robot: what moves, without payloads, which are carried.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from linkwise_runtime.rule.joint_tree import TreeLink

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.study.plan import SUBJECT, StudyPlan
from linkwise.study.subjects import SubjectSize
from linkwise.study.summary import TrialSummary

GRAVITY = 9.80665
"""Standard gravity in m/s²."""
LOAD = re.compile(r"(?P<what>N·m|N|W|J)(?P<over>(·s)?)")
"""Units of what depends on a person's size, and of its integrals over time."""
ALIKE = 1e-3
"""Relative difference of masses up to which subjects count as equally heavy."""


class Scale(NamedTuple):
    """Factor by which a column is multiplied, and its unit then."""

    factor: float
    unit: str


def scale_of(unit: str, normalise: str, body: SubjectSize) -> Scale:
    """Return how a column of a unit is normalised; angles and all else stay as they are."""
    found = LOAD.fullmatch(unit)
    if found is None or normalise in ("", "none"):
        return Scale(1.0, unit)
    weight = body.mass * GRAVITY
    if normalise == "weight*height" and found["what"] == "N·m":
        return Scale(100 / (weight * body.height), f"% BW·height{found['over']}")
    if normalise == "weight*height" and found["what"] == "N":
        return Scale(100 / weight, f"% BW{found['over']}")
    return Scale(1 / body.mass, f"{unit}/kg")


def normalised(plan: StudyPlan, trials: Sequence[TrialSummary]) -> list[TrialSummary]:
    """Return the trials, normalised as the study asks."""
    if plan.normalise in ("", "none"):
        return list(trials)
    return [_normalised(one, plan.normalise, body_of(plan, one)) for one in trials]


def body_of(plan: StudyPlan, trial: TrialSummary) -> SubjectSize:
    """Return mass and height of a trial's subject, NaN where they are not known."""
    told = plan.bodies.get(trial.labels[SUBJECT], SubjectSize())
    return replace(told, mass=trial.mass) if math.isnan(told.mass) else told


def _normalised(trial: TrialSummary, normalise: str, body: SubjectSize) -> TrialSummary:
    scales = {name: scale_of(unit, normalise, body) for name, unit in trial.units.items()}
    return replace(
        trial,
        units={name: scale.unit for name, scale in scales.items()},
        statistics={name: scales[name].factor * values for name, values in trial.statistics.items()},
        curves={name: _scale(scales, name).factor * curve for name, curve in trial.curves.items()},
    )


def _scale(scales: Mapping[str, Scale], name: str) -> Scale:
    """Return the scale of a curve; a part of a deviation that is no column has that of what it is of."""
    return scales[name] if name in scales else scales[name.partition("/")[2]]


def normalised_unit(unit: str, normalise: str) -> str:
    """Return the unit of a column as it is normalised."""
    return scale_of(unit, normalise, SubjectSize(1.0, 1.0)).unit


def of_several_masses(plan: StudyPlan, trials: Sequence[TrialSummary]) -> tuple[str, ...]:
    """Return a line where subjects of different mass are averaged, and nothing was said of it."""
    masses: dict[str, float] = {}
    for trial in trials:
        masses.setdefault(trial.labels[SUBJECT], body_of(plan, trial).mass)
    known = [mass for mass in masses.values() if not math.isnan(mass)]
    if plan.normalise or len(known) < 2 or max(known) - min(known) <= ALIKE * max(known):
        return ()
    return (
        f"subjects have {min(known):.4g} to {max(known):.4g} kg, and torques of all are averaged in N·m; give"
        ' the study normalise = "mass" or "weight*height", or "none" if that is meant',
    )


def of_their_robots(plan: StudyPlan, trials: Sequence[TrialSummary]) -> tuple[str, ...]:
    """Return a line where a table of masses lacks subjects, whose robots then tell theirs."""
    there = dict.fromkeys(trial.labels[SUBJECT] for trial in trials)
    lacking = [name for name in there if name not in plan.bodies]
    is_of_mass = any(not math.isnan(body.mass) for body in plan.bodies.values())
    if plan.normalise in ("", "none") or not is_of_mass or not lacking:
        return ()
    others = [name for name in plan.bodies if name not in there]
    by = f"'subjects' lacks {listed(map(repr, lacking))}, normalised by the mass of the robot of each trial"
    told = f"; it has {listed(map(repr, others))}, of whom there is no trial" if others else ""
    return (by + told,)


def told_of_bodies(plan: StudyPlan, trials: Iterable[TrialSummary]) -> dict[str, object]:
    """Return how results are normalised, as plain data; empty where they are not."""
    if plan.normalise in ("", "none"):
        return {}
    bodies = {one.name: body_of(plan, one) for one in trials}
    return {
        "by": plan.normalise,
        "trials": {
            name: {key: value for key, value in vars(body).items() if not math.isnan(value)}
            for name, body in bodies.items()
        },
        "not_normalised": "tables of trials, which have N·m, N, W and J",
    }


def check_bodies(plan: StudyPlan) -> None:
    """Raise LinkwiseError for subjects without a height that the study asks for."""
    for trial in plan.trials if plan.normalise == "weight*height" else ():
        subject = trial.label(SUBJECT)
        if math.isnan(plan.bodies.get(subject, SubjectSize()).height):
            raise LinkwiseError(
                f"normalise = {plan.normalise!r}: there is no height of {subject!r}; give the study"
                " 'subjects', a CSV file of subject, height in m and, where it is not the robot's, mass in kg"
            )


def check_mass(plan: StudyPlan, robot: str, links: Iterable[TreeLink]) -> None:
    """Raise LinkwiseError where a robot has no mass, and trials of it are normalised without a told one."""
    if plan.normalise in ("", "none") or own_mass(links) > 0:
        return
    for trial in plan.trials:
        told = plan.bodies.get(trial.label(SUBJECT), SubjectSize()).mass
        if trial.robot == robot and math.isnan(told):
            raise LinkwiseError(
                f"normalise = {plan.normalise!r}: the robot does not say its mass; give the study"
                " 'subjects', a CSV file of subject and mass in kg"
            )


def own_mass(links: Iterable[TreeLink]) -> float:
    """Return the mass of what a robot moves, in kg."""
    return sum(link.mass for link in links)
