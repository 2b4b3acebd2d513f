"""A walk along the table of checks."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import groupby
from pathlib import Path

import numpy as np

from linkwise.check.answers import BackendAnswers, compiled_beside, in_turn, subjects
from linkwise.check.as_generated import GeneratedFiles
from linkwise.check.compare import Result, is_short_of_memory, line_of, skipped
from linkwise.check.subject import Subject
from linkwise.check.table import CHECKS, Check
from linkwise.own_process import Ended
from linkwise.package.load import Package, refuse_exit
from linkwise.package.manifest import Manifest

SAMPLES = 100
"""Number of random states, unless another is asked for."""


def check_package(directory: Path, samples: int = SAMPLES) -> list[Result]:
    """Run every check on a package and return the results.

    Raises LinkwiseError when `directory` holds no package that can be read.
    """
    return list(results_of(directory, samples))


def results_of(directory: Path, samples: int = SAMPLES) -> Iterator[Result]:
    """Yield the results of every check on a package, each as soon as it is there.

    Raises LinkwiseError when `directory` holds no package that can be read.
    """
    files = GeneratedFiles(directory, Manifest.read(directory))
    for check in (check for check in CHECKS if check.of is GeneratedFiles):
        results = [*check.run(check.title, files)]
        yield from results
        if check.needed and any(result.failed for result in results):
            return
    compiled = compiled_beside(files.package)
    yield from _guarded("answers", _of_package(files.package, samples))
    with suppress(Ended):
        compiled()


def _of_package(package: Package, samples: int) -> Iterator[Result]:
    """Yield the results on an imported package, for each set of values of its parameters."""
    for subject in subjects(package, samples):
        for of_each, neighbours in groupby(CHECKS, lambda check: check.of):
            checks = [*neighbours]
            if of_each is BackendAnswers:
                for answers in in_turn(subject):
                    yield from _of_one(checks, answers)
            if of_each is Subject:
                for check in checks:
                    if check.applies(subject):
                        yield from check.run(f"{check.title}{subject.label}", subject)


def _of_one(checks: Iterable[Check[BackendAnswers]], answers: BackendAnswers) -> Iterator[Result]:
    """Yield the results on one back end: a check that breaks off leaves the others as they are."""
    for check in checks:
        if check.applies(answers):
            yield from _guarded(f"{answers.name}: {check.title}", iter(check.run(answers.name, answers)))


def _guarded(title: str, results: Iterator[Result]) -> Iterator[Result]:
    """Yield results up to where a check breaks off, and then one that reports so: other checks still run.

    Each result is computed by itself, since the settings used meanwhile must not reach whoever receives it.
    """
    while True:
        try:
            # A user's energies need not be defined everywhere.
            with refuse_exit(), np.errstate(all="ignore"), _one_thread():
                result = next(results, None)
        except Exception as error:
            if is_short_of_memory(error):
                yield skipped(title, f"it takes more memory than there is here: {line_of(error)}")
            else:
                yield Result(title, False, None, line_of(error))
            return
        if result is None:
            return
        yield result


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let torch compute in one thread if it is loaded: with few samples, further threads only wait."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
