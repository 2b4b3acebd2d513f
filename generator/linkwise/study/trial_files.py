"""Files that a trial depends on, and copies of those at addresses while it runs."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from linkwise.analysis.loads.load_files import data_files
from linkwise.errors import LinkwiseError
from linkwise.package.manifest import FILE
from linkwise.robot import robot_files
from linkwise.study.study_paths import beside, copied_here, is_address, opened_here
from linkwise.study.study_plan import StudyPlan, Trial


def trial_files(plan: StudyPlan, trial: Trial) -> Iterator[str]:
    """Yield all files that a trial's numbers depend on."""
    yield from _inside(trial.log)
    for path in (*trial.choices.loads, *trial.choices.contact_loads):
        yield path
        yield from _data_of(path)
    if Path(trial.robot).is_dir():
        yield str(Path(trial.robot) / FILE)
    elif is_address(trial.robot):
        yield trial.robot
    else:
        yield from (str(path) for path in robot_files(trial.robot, plan.options) if path.is_file())
    if plan.cycles is not None and plan.cycles.table:
        yield plan.cycles.table


@contextmanager
def trial_here(trial: Trial) -> Iterator[Trial]:
    """Give the trial with its log and loads on this machine; copies keep their names until the block ends."""
    with ExitStack() as copies:

        def here(path: str) -> str:
            copy = copies.enter_context(opened_here(path))
            if is_address(path):
                for data in _data_of(path):
                    copied_here(data, copy.parent / data.removeprefix(beside(path, "")))
            return str(copy)

        choices = replace(
            trial.choices,
            loads=tuple(map(here, trial.choices.loads)),
            contact_loads=tuple(map(here, trial.choices.contact_loads)),
        )
        yield replace(trial, log=here(trial.log), choices=choices)


def _inside(path: str) -> Iterator[str]:
    """Yield the file itself; of a folder, such as a bag, all files in it."""
    if not is_address(path) and Path(path).is_dir():
        yield from sorted(str(file) for file in Path(path).rglob("*") if file.is_file())
    else:
        yield path


def _data_of(path: str) -> list[str]:
    """Return the files of numbers that an OpenSim file of loads names.

    It is empty if the file cannot be read, which the analysis reports.
    """
    if not path.lower().endswith(".xml"):
        return []
    with opened_here(path) as copy:
        try:
            found = data_files(copy)
        except LinkwiseError:
            return []
        if not is_address(path):
            return list(map(str, found))
        inside = [data.relative_to(copy.parent) for data in found if data.is_relative_to(copy.parent)]
    return [beside(path, data.as_posix()) for data in inside if ".." not in data.parts]
