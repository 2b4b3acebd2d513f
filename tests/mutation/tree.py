"""A copy of the project in which one file at a time is changed, and tests in processes forked from here."""

import compileall
import gc
import importlib
import json
import os
import py_compile
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock

from mutation.mutants import Mutant

ROOT = Path(__file__).parents[2]
HEAVY = (
    *("numpy", "sympy", "torch", "jinja2", "typer", "rich", "pytest", "hypothesis", "fsspec", "tomlkit"),
    *("scipy.signal", "scipy.optimize", "scipy.spatial", "scipy.interpolate", "clarabel", "networkx"),
    *("pyarrow.parquet", "xarray", "zarr", "h5netcdf", "h5py", "matplotlib.pyplot", "plotly.graph_objects"),
    *("mujoco", "pinocchio", "defusedxml.ElementTree"),
)
"""Loaded once, before the first fork; nothing of linkwise is."""
PLAIN = ("-q", "-p", "no:cacheprovider", "--no-header", "--tb=short", "--assert=plain", "--disable-warnings")
MEMORY = 12 * 2**30
"""Bytes that a run of tests may fill, with its programs: a loop without an end fills them all.

It is watched, for under the system's own limit of memory programs do not run that look after their memory.
"""
WATCHED = 0.2
"""Seconds between two looks at what runs."""
FORKING = Lock()
"""Held to fork, and by whoever takes locks of libraries beside it: a child would wait for them for ever."""
_IGNORED = shutil.ignore_patterns("__pycache__", "mutation", "test_mutation.py")


@dataclass(frozen=True)
class Ended:
    """End of a run of tests.

    code: pytest's exit status, or minus the signal; by: the first test that failed, "" where none was told;
    again: whether it failed again when it ran alone
    """

    code: int
    by: str = ""
    again: bool = True

    @property
    def passed(self) -> bool:
        """Return whether every test passed; that there was none is no failure."""
        return self.code in (0, 5)

    @property
    def too_slow(self) -> bool:
        """Return whether it was ended for the time it took."""
        return self.code in (-signal.SIGXCPU, -signal.SIGALRM)


class Tree:
    """A copy of the project in which one file at a time is changed."""

    def __init__(self, folder: Path) -> None:
        """Copy, and compile so that a changed source is never taken for its bytecode."""
        self.folder = folder
        self.child = 0
        self.stopped = False
        for name in ("linkwise", "linkwise_runtime"):
            shutil.copytree(ROOT / "generator" / name, folder / name, ignore=_IGNORED)
        shutil.copytree(
            ROOT / "templates", folder / "linkwise/templates", ignore=_IGNORED, dirs_exist_ok=True
        )
        shutil.copytree(ROOT / "tests", folder / "tests", ignore=_IGNORED)
        for name in ("README.md", "pyproject.toml", "Makefile"):
            shutil.copy(ROOT / name, folder / name)
        for name in ("generator", "templates", "generated", "docs", "examples"):
            (folder / name).symlink_to(ROOT / name)
        mode = py_compile.PycInvalidationMode.CHECKED_HASH
        compileall.compile_dir(folder, quiet=2, invalidation_mode=mode)

    def place(self, path: str) -> Path:
        """Return the place of a file of the project in this copy."""
        inner = path.removeprefix("generator/")
        return self.folder / (inner if inner != path else f"linkwise/{path}")

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        """Within it, the copy has the change."""
        file = self.place(mutant.path)
        original = file.read_text(encoding="utf-8")
        file.write_text(mutant.applied(original), encoding="utf-8")
        try:
            yield
        finally:
            file.write_text(original, encoding="utf-8")

    def tested(self, tests: Sequence[str], cpu: float, deselected: Sequence[str] = ()) -> Ended:
        """Run tests until one fails, and that one again, within `cpu` seconds of processor time.

        A file that cannot be imported is tried again in another process: its imports are half there in this.
        """
        told = self.folder / "told.json"
        told.unlink(missing_ok=True)
        leave = [f"--deselect={name}" for name in deselected]

        def fails(pytest_main: Callable[..., int], by: str) -> bool:
            return int(pytest_main(["-x", *leave, by], [First()])) not in (0, 5)

        def work(pytest_main: Callable[..., int]) -> int:
            first = First()
            code = int(pytest_main(["-x", *leave, *tests], [first]))
            if code == 1 or first.by:
                again = "::" not in first.by or fails(pytest_main, first.by)
                told.write_text(json.dumps({"by": first.by, "again": again}))
            return code

        code = self.forked(work, cpu)
        ended = Ended(code, **(json.loads(told.read_text()) if told.is_file() and code > 0 else {}))
        if ended.by and "::" not in ended.by:
            again = self.forked(lambda pytest_main: int(fails(pytest_main, ended.by)), cpu) != 0
            return replace(ended, again=again)
        return ended

    def forked(self, work: Callable[[Callable[..., int]], int], cpu: float) -> int:
        """Exit status, or minus the signal, of work in a process forked from this one.

        It ends after `cpu` seconds of processor time, or four times as many on the clock.
        """
        if self.stopped:
            raise SystemExit("stopped")
        with FORKING:
            self.child = os.fork()
        if self.child == 0:
            _child(self.folder, work, cpu)
        while not (ended := os.waitpid(self.child, os.WNOHANG))[0]:
            time.sleep(WATCHED)
            if _filled(self.child) > MEMORY:
                self._end()
        status = ended[1]
        self._end()  # what a test left running
        if self.stopped:
            raise SystemExit("stopped")
        return os.waitstatus_to_exitcode(status)

    def stop(self) -> None:
        """End what runs, and begin nothing any more."""
        self.stopped = True
        self._end()

    def _end(self) -> None:
        if self.child:
            with suppress(ProcessLookupError):
                os.killpg(self.child, signal.SIGKILL)


class First:
    """Notes the first test, or file of tests, that fails."""

    by = ""

    def pytest_runtest_logreport(self, report: object) -> None:
        self._note(report)

    def pytest_collectreport(self, report: object) -> None:
        self._note(report)

    def _note(self, report: object) -> None:
        if getattr(report, "failed", False) and not self.by:
            self.by = str(report.nodeid)  # type: ignore[attr-defined]


def _filled(group: int) -> int:
    """Bytes of memory that the processes of a group fill; 0 where there is no /proc."""
    pages = 0
    for place in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # one that has ended since
            fields = place.read_text(encoding="utf-8").rpartition(")")[2].split()
            pages += int(fields[21]) if int(fields[2]) == group else 0
    return pages * resource.getpagesize()


def say(line: str) -> None:
    """Print a line."""
    with FORKING:
        print(line, flush=True)


def load_heavy() -> None:
    """Load what tests load, and say which of it is lacking."""
    for name in HEAVY:
        try:
            importlib.import_module(name)
        except ImportError:
            say(f"without {name}: tests that need it are skipped")
    gc.freeze()  # else each process that is forked looks through all of it, several times


def _child(folder: Path, work: Callable[[Callable[..., int]], int], cpu: float) -> None:
    """Do the work in this forked process, which ends with its status."""
    os.setpgid(0, 0)
    out = os.open(folder / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (int(cpu) + 1, int(cpu) + 6))
    signal.alarm(int(4 * cpu) + 1)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)  # ignored in the background: programs under test inherit that
    os.chdir(folder)
    cache = folder.parent / "cache"
    os.environ |= {
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "LINKWISE_TEST_CACHE": str(cache),
    }
    sys.dont_write_bytecode = True
    tests = str(ROOT / "tests")
    sys.path[:] = [str(folder), *(place for place in sys.path if not place.startswith(tests))]
    importlib.invalidate_caches()
    import pytest

    def pytest_main(arguments: Sequence[str], plugins: Sequence[object]) -> int:
        places = [f"--basetemp={folder}/temp", f"--rootdir={folder}"]
        return int(pytest.main([*PLAIN, *places, *arguments], plugins=list(plugins)))

    code = 70
    try:
        code = work(pytest_main)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
