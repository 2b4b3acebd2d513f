"""The other side of `worker`: sends cases, starts a worker again that died, hung or grew."""

import os
import pickle
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, cast

from helpers.search_path import before

from fuzz.case import Case
from fuzz.worker import MODULES, Outcome

TESTS = Path(__file__).parents[1]
PATIENCE = 90.0
"""Seconds of wall-clock time; a worker measures CPU time itself, while it can."""


class Client:
    """One worker, started when it is needed; a case may take so many seconds of CPU time.

    The worker imports the modules before its first case.
    """

    def __init__(self, seconds: float = 10.0, modules: Sequence[str] = MODULES) -> None:
        self._seconds, self._modules = seconds, tuple(modules)
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def run(self, case: Case) -> Outcome:
        """Outcome of a case; the end of the worker is one, too."""
        process = self._process or self._start()
        given, answers = cast(IO[bytes], process.stdin), cast(IO[bytes], process.stdout)
        pickle.dump(case, given)
        given.flush()
        if not select.select([answers], [], [], PATIENCE)[0]:
            self._end()
            return Outcome(None, "", (f"no answer within {PATIENCE:g} s",), "hang outside Python")
        try:
            outcome: Outcome = pickle.load(answers)
        except (EOFError, pickle.UnpicklingError):
            status = process.wait()
            self._end()
            return Outcome(
                None, "", (f"the process ended with status {status}",), f"end with status {status}"
            )
        if outcome.status is None or any(fault.startswith("took") for fault in outcome.faults):
            self._end()
        return outcome

    def _start(self) -> subprocess.Popen[bytes]:
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from fuzz.worker import serve; serve({self._seconds}, {self._modules})"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | threads | {"PYTHONPATH": before(TESTS)},
        )
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        self._process = None
