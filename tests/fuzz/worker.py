"""A process that runs command lines one after the other under limits and says what each did.

Cases come in on stdin and outcomes go out on stdout, pickled. A case may succeed, or exit with status 2, one
line on stderr and nothing written. It may not write outside its `--out`, leave a file behind, take more than
10 s of CPU time or 1 GB, start a program, or print a traceback.
"""

import contextlib
import io
import os
import pickle
import re
import resource
import signal
import sys
import tempfile
import traceback
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import FrameType

from fuzz.case import Case
from fuzz.room import Room, Watch

LIBRARIES = ("h5py", "matplotlib.pyplot", "mujoco", "plotly.graph_objects", "pyarrow.parquet", "scipy.signal")
COMMANDS = ("analyze", "check", "inspect", "motion", "report_reduction", "report_terms")
MODULES = (*LIBRARIES, *(f"linkwise.cli.{command}" for command in COMMANDS))
"""Modules that commands import."""
GIGABYTE = 1 << 30
LONGEST = 1100
"""Characters of a message and what stands before it, the folder apart."""
RUN = " is a Python program, which was run"
"""End of a note of it, which stands before the error."""
FAULT = re.compile(r"linkwise: fault: (\w+ \([^)]*\))")
"""Message of a fault of linkwise itself, with its place."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a case; `faults` is empty where that was right, `place` tells like faults from others."""

    status: int | None
    message: str
    faults: tuple[str, ...] = ()
    place: str = ""
    trace: str = ""


def most_memory() -> int:
    """Most bytes that this process has held, or one that it forked.

    ru_maxrss begins with those of the process that started one: of this one's it would tell another's.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    own = int(re.findall(r"VmHWM:\s+(\d+) kB", status)[0])
    return max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) * 1024


class Hang(BaseException):
    """Too much CPU time."""


class Worker:
    """Runs cases; one a process. What is imported before takes no time of a case."""

    def __init__(self, folder: Path, seconds: float, modules: Sequence[str]) -> None:
        from linkwise import generate, read_system, write_package
        from linkwise.cli import app

        for module in modules:
            import_module(module)

        sys.dont_write_bytecode = True
        self.main, self.seconds = app.main, seconds
        write_package(generate(read_system("planar3"), ["numpy"]), folder / "planar3")
        self.room = Room(folder / "room", folder / "planar3")
        self.streams = folder / "stdout", folder / "stderr"
        os.environ |= {"HOME": str(self.room.places["home"]), "LINKWISE_CACHE": str(self.room.places["home"])}
        signal.signal(signal.SIGPROF, self._hang)
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        self.held = most_memory()
        resource.setrlimit(resource.RLIMIT_AS, (used + 3 * GIGABYTE, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_FSIZE, (GIGABYTE, resource.RLIM_INFINITY))
        self.watch = Watch()

    @staticmethod
    def _hang(number: int, frame: FrameType | None) -> None:
        raise Hang

    def run(self, case: Case) -> Outcome:
        """Run one case."""
        sys.argv = ["linkwise", *self.room.fill(case)]
        status, trace, place = self._called()
        error = self.streams[1].read_text(encoding="utf-8", errors="backslashreplace")
        faults = list(self._faults(status, error, trace, case))
        faults += self.room.left_behind(status)
        faults += [f"outside: {what}" for what in dict.fromkeys(self.watch.seen)]
        peak = most_memory() - self.held  # a fork begins with what all libraries hold
        if peak > GIGABYTE:
            faults.append(f"took {peak / GIGABYTE:.1f} GB")
        if fault := FAULT.search(error):
            place = fault[1]
        self.watch.seen.clear()
        for name in [name for name in sys.modules if name.startswith("_linkwise_")]:
            del sys.modules[name]
        return Outcome(status, error, tuple(faults), place, trace)

    def _called(self) -> tuple[int | None, str, str]:
        """Exit status, and the traceback of what ought not to have come this far and where it began."""
        with self._redirected():
            self.watch.inside = str(self.room.root)
            try:
                self._main_in_time()
                return 0, "", ""
            except SystemExit as end:
                return (end.code if isinstance(end.code, int) else 1), "", ""
            except BaseException as error:
                own = [f for f in traceback.extract_tb(error.__traceback__) if "/linkwise/" in f.filename]
                at = f"{Path(own[-1].filename).name}:{own[-1].name}" if own else "?"
                return None, traceback.format_exc(limit=-8), f"{type(error).__name__} in {at}"
            finally:
                self.watch.inside = None

    def _main_in_time(self) -> None:
        """Run the command; the timer ends within, as a case's memory is freed where its error is handled."""
        signal.setitimer(signal.ITIMER_PROF, self.seconds)
        try:
            self.main()
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)

    @contextlib.contextmanager
    def _redirected(self) -> Iterator[None]:
        """Send what Python and what libraries print into files, as a shell would."""
        for number, file in zip((1, 2), self.streams, strict=True):
            opened = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(opened, number)
            os.close(opened)
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), encoding="utf-8")
        sys.stderr = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), "utf-8", "backslashreplace")
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(UnicodeEncodeError):
                    stream.flush()

    def _faults(self, status: int | None, error: str, trace: str, case: Case) -> Iterator[str]:
        if status is None:
            yield trace.strip().splitlines()[-1][:200]
        lines = error.splitlines()
        if status == 2:
            told = [line for line in lines if not (line.startswith("note: ") and line.endswith(RUN))]
            if len(told) != 1 or not error.endswith("\n"):
                yield f"{len(told)} lines on stderr with exit status 2"
            if not lines or not lines[-1].startswith("linkwise: error: "):
                yield "the last line on stderr is not the error"
            if len(error.replace(str(self.room.root), "")) > LONGEST:
                yield f"a message of {len(error)} characters"
        if status not in (0, 2, None) and not (status == 1 and case.arguments[0] == "check"):
            yield f"exit status {status}: {error[:300]}"
        if odd := {
            mark for mark in error.replace("\n", "") if unicodedata.category(mark) in ("Cc", "Cs", "Zl", "Zp")
        }:
            yield f"control characters on stderr: {sorted(odd)!a}"


def serve(seconds: float, modules: Sequence[str]) -> None:
    """Answer cases until stdin ends."""
    answers = os.fdopen(os.dup(1), "wb")
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        worker = Worker(Path(folder), seconds, modules)
        while True:
            try:
                case = pickle.load(sys.stdin.buffer)
            except EOFError:
                break
            pickle.dump(worker.run(case), answers)
            answers.flush()
        os.chdir("/")
