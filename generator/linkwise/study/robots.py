"""Robots of a study: each is generated before any trial begins, and all are of one kind."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.version import VERSION

from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, short
from linkwise.package.manifest import FILE, Manifest
from linkwise.package_cache import KeptPackage, kept_package
from linkwise.pipeline import PYTHON
from linkwise.progress import Progress
from linkwise.robot import is_description
from linkwise.robot.read import most_bytes
from linkwise.study.normalised import check_mass
from linkwise.study.paths import is_address, opened_here, require_there, told_of, version_of
from linkwise.study.plan import CAUSES, RIGHT, StudyPlan
from linkwise.study.sides import neutral

ROBOTS = 4
"""Most robots that a worker keeps in memory: trials of one subject follow one another."""


def check_robots(plan: StudyPlan, progress: Progress) -> tuple[str, ...]:
    """Make the packages of all robots; return the warnings that concern their torques, in lines.

    Raises LinkwiseError for what cannot be read or generated, and for a robot whose joints or links are not
    those of the others.
    """
    first: tuple[str, Manifest] | None = None
    told: list[str] = []
    robots = list(dict.fromkeys(trial.robot for trial in plan.trials))
    for number, robot in enumerate(robots):
        progress("robots", number, len(robots))
        with within(f"{plan.file}: {_owner(plan, robot)}"):
            kept = package_of(robot, plan)
            told += kept.warnings
            manifest = Manifest.read(kept.directory)
            if first is not None:
                _compare(first, robot, manifest)
            _check_figures(plan, [joint.name for joint in manifest.joints])
            check_mass(plan, robot, () if manifest.tree is None else manifest.tree.links)
        first = first or (robot, manifest)
    progress("robots", len(robots), len(robots))
    return tuple(told)


def _owner(plan: StudyPlan, robot: str) -> str:
    return f"trial {next(trial.name for trial in plan.trials if trial.robot == robot)!r}"


def _check_figures(plan: StudyPlan, joints: Sequence[str]) -> None:
    """Raise LinkwiseError for a figure of what loads a joint that the robot does not have."""
    is_sided = plan.cycles is not None and plan.cycles.sides != ""
    known = list(dict.fromkeys(neutral(name, RIGHT) if is_sided else name for name in joints))
    for joint in (joint for figure in plan.figures for joint in figure.joints):
        if joint not in known:
            raise LinkwiseError(
                f"[[figure]]: 'columns' has {short(f'{CAUSES}{joint}', 80)!r}, and the robot has no such"
                f" joint; nearest are {listed(map(repr, nearest_first(joint, known)))}"
            )


def package_of(robot: str, plan: StudyPlan) -> KeptPackage:
    """Return the package of a trial's robot: itself, or the cached one of its file, address or name.

    Raises LinkwiseError, before it is fetched or run, for a Python file that does not exist or is not
    trusted, and before it is run, for a package of another version.
    """
    if Path(robot).suffix == PYTHON:
        _refuse_untrusted(robot, plan)
    options = plan.options
    if is_description(robot) and not is_address(robot) and not Path(robot).exists():
        return kept_package(robot, options=options)
    with opened_here(robot, most_bytes(robot)) as path:
        if Path(path).is_dir() and not plan.trust_python:
            _refuse_unread(robot, Path(path))
        kept = kept_package(path, options=options)
    return replace(kept, warnings=tuple(told_of(robot, path, warning) for warning in kept.warnings))


def _refuse_untrusted(robot: str, plan: StudyPlan) -> None:
    if is_address(robot):
        raise LinkwiseError(
            f"robot {robot} is a Python program from elsewhere, which is never run; fetch it, read it, and"
            " name your copy"
        )
    require_there(robot)
    if not plan.trust_python:
        raise LinkwiseError(
            f"robot {robot} is a Python program, which a study does not run by itself; read it, and give"
            " --trust-python if you trust it"
        )


def _refuse_unread(robot: str, package: Path) -> None:
    """Raise LinkwiseError for a package whose runtime is of another linkwise: it would run as it is."""
    version = Manifest.read(package).generator.get("linkwise")
    if version != VERSION:
        raise LinkwiseError(
            f"robot {robot} is a package of linkwise {version}, whose code is not at hand to compare with;"
            " generate it again, or read it, and give --trust-python if you trust it"
        )


def opened_robot(robot: str, plan: StudyPlan) -> OpenedRobot:
    """Return a trial's robot, loaded; those of the last trials are kept in memory."""
    directory = package_of(robot, plan).directory
    return loaded(directory, version_of(str(directory / FILE)))


@lru_cache(ROBOTS)
def loaded(directory: Path, version: str) -> OpenedRobot:
    """Return the robot of a package whose manifest is of that version."""
    return load_robot(directory)


def _compare(first: tuple[str, Manifest], robot: str, manifest: Manifest) -> None:
    other, known = first
    for what, own, others in (
        ("joints", [j.name for j in manifest.joints], [j.name for j in known.joints]),
        ("links", [link.name for link in manifest.links], [link.name for link in known.links]),
    ):
        if own != others:
            apart: Sequence[str] = (
                [n for n in own if n not in others] or [n for n in others if n not in own] or own
            )
            raise LinkwiseError(
                f"robot {robot} is another one than {other}: they differ in the {what}"
                f" {listed(map(repr, apart))}; a study is of one kind of robot"
            )
