"""Mutation testing of generator, runtime and templates: what may be wrong without a test noticing?

    python tests/mutation/run.py --out out/mutate [--each 25] [--only dynamics emit] [--jobs 2] [--seed 0]

Each mutant runs in a process forked from one that has the heavy libraries, in a copy of the tree. A mutant is
killed when a test of its room fails, takes more processor time than LIMIT, or hangs. What survives is to be
killed by a test, or listed in equivalents.json with the reason why it changes nothing that is promised.
"""

import argparse
import compileall
import importlib
import json
import os
import py_compile
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from mutants import Mutant, mutants
from rooms import ROOMS, Room

ROOT = Path(__file__).parents[2]
EQUIVALENTS = Path(__file__).with_name("equivalents.json")
LIMIT = 120
"""Seconds of processor time for the tests of one mutant."""
PATIENCE = 600
"""Seconds after which a mutant that waits for something counts as killed, too."""
OF_A_FILE = 50
"""Mutants of one file at most."""

HEAVY = (
    *(
        "numpy",
        "sympy",
        "torch",
        "jinja2",
        "typer",
        "rich",
        "pytest",
        "hypothesis",
        "scipy.signal",
        "pyarrow",
    ),
    *("matplotlib.pyplot", "plotly.graph_objects", "mujoco", "pinocchio", "defusedxml.ElementTree"),
)
"""Loaded once, before the first fork; nothing of linkwise is."""


@dataclass(frozen=True)
class Outcome:
    """What became of a mutant: killed, survived or too slow, and by which test; None: the tests alone."""

    room: str
    mutant: Mutant | None
    verdict: str
    by: str

    def entry(self) -> dict[str, str]:
        """Line of the record."""
        assert self.mutant is not None
        return {"room": self.room, "mutant": self.mutant.key, "verdict": self.verdict, "by": self.by}


class Tree:
    """A copy of the project in which one file at a time is changed."""

    def __init__(self, folder: Path) -> None:
        """Copy, and compile so that a changed source is never taken for its bytecode."""
        self.folder = folder
        shutil.copytree(ROOT / "generator/linkwise", folder / "linkwise", ignore=_IGNORED)
        shutil.copytree(ROOT / "templates", folder / "linkwise/templates", ignore=_IGNORED)
        shutil.copytree(ROOT / "tests", folder / "tests", ignore=_IGNORED)
        for name in ("README.md", "pyproject.toml", "Makefile"):
            shutil.copy(ROOT / name, folder / name)
        for name in ("generator", "templates", "generated", "docs"):
            (folder / name).symlink_to(ROOT / name)
        mode = py_compile.PycInvalidationMode.CHECKED_HASH
        compileall.compile_dir(folder, quiet=2, invalidation_mode=mode)

    def place(self, path: str) -> Path:
        """Where a file of the project is in this copy."""
        inner = path.removeprefix("generator/linkwise/")
        return self.folder / "linkwise" / inner

    def tested(self, mutant: Mutant | None, room: Room) -> tuple[str, str]:
        """Verdict of the tests on a mutant, and the test that gave it."""
        tests = [*room.tests, *(("-k", room.only) if room.only else ())]
        if mutant is None:
            return self._run(tests)
        file = self.place(mutant.path)
        original = file.read_text(encoding="utf-8")
        file.write_text(mutant.applied(original), encoding="utf-8")
        try:
            return self._run(tests)
        finally:
            file.write_text(original, encoding="utf-8")

    def _run(self, tests: Sequence[str]) -> tuple[str, str]:
        log = self.folder / "log.txt"
        child = os.fork()
        if child == 0:
            _child(self.folder, tests, log)
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGALRM):
            return "too slow", ""
        code = os.waitstatus_to_exitcode(status)
        lines = log.read_text(errors="replace").splitlines()
        failed = next((line for line in lines if line.startswith(("FAILED", "ERROR"))), f"exit {code}")
        return ("survived", "") if code == 0 else ("killed", failed[:160])


_IGNORED = shutil.ignore_patterns("__pycache__", "mutation")


def _child(folder: Path, tests: Sequence[str], log: Path) -> None:
    """Run tests in this forked process, which ends with their verdict."""
    os.setpgid(0, 0)
    out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 5))
    signal.alarm(PATIENCE)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)  # ignored in the background: programs under test inherit that
    os.chdir(folder)
    os.environ |= {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1", "LINKWISE_TEST_CACHE": _CACHE}
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    import pytest

    code = 1
    try:
        plain = [
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "--no-header",
            "--tb=no",
            "--assert=plain",
            f"--basetemp={folder}/temp",
        ]
        code = int(pytest.main([*plain, "-rfE", f"--rootdir={folder}", *tests]))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


_CACHE = str(Path(tempfile.gettempdir()) / f"linkwise-mutants-{os.getpid()}")


def room_mutants(room: Room, each: int, seed: int) -> list[Mutant]:
    """Mutants of a room, the same ones for the same text: files in turn, lines at random."""
    chosen = random.Random(seed)
    groups = []
    for top in ("generator/linkwise", "templates"):
        for path in sorted((ROOT / top).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if path.is_file() and room.holds(name) and "__pycache__" not in name:
                text = path.read_text(encoding="utf-8")
                group = list(mutants(name, text))
                chosen.shuffle(group)
                groups.append([mutant for mutant in group[:OF_A_FILE] if mutant.parses(text)])
    total = sum(map(len, groups))
    # Long files get more: each line has the same chance.
    drawn = [(k / len(group), g, group[k]) for g, group in enumerate(groups) for k in range(len(group))]
    drawn.sort(key=lambda item: item[:2])
    return [mutant for *_, mutant in drawn][: min(each, total)]


def outcomes(work: Sequence[tuple[str, Mutant | None]], jobs: int, folder: Path) -> Iterator[Outcome]:
    """Verdict on each mutant, `jobs` side by side."""
    trees: SimpleQueue[Tree] = SimpleQueue()
    for k in range(jobs):
        trees.put(Tree(folder / str(k)))

    def one(item: tuple[str, Mutant | None]) -> Outcome:
        name, mutant = item
        tree = trees.get()
        try:
            return Outcome(name, mutant, *tree.tested(mutant, ROOMS[name]))
        finally:
            trees.put(tree)

    pool = ThreadPoolExecutor(jobs)
    try:
        yield from pool.map(one, work)
    finally:
        pool.shutdown(cancel_futures=True)


def main() -> None:
    """Run, report, and fail where a mutant survives that nobody has explained."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out/mutate"))
    parser.add_argument("--each", type=int, default=25, help="mutants of each room")
    parser.add_argument("--only", nargs="*", default=list(ROOMS), choices=list(ROOMS), metavar="ROOM")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in HEAVY:
        try:
            importlib.import_module(name)
        except ImportError:
            print(f"without {name}: tests that need it are skipped")
    explained = json.loads(EQUIVALENTS.read_text())
    work: list[tuple[str, Mutant | None]] = []
    for name in options.only:
        found = room_mutants(ROOMS[name], options.each, options.seed)
        work += [(name, None), *((name, mutant) for mutant in found if mutant.key not in explained)]
    options.out.mkdir(parents=True, exist_ok=True)
    record: list[Outcome] = []
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for outcome in outcomes(work, options.jobs, Path(folder)):
            if outcome.mutant is None:
                if outcome.verdict != "survived":
                    sys.exit(f"the tests of {outcome.room} fail without a mutant: {outcome.by}")
                continue
            record.append(outcome)
            if outcome.verdict == "survived":
                print(f"survives: {outcome.mutant.key} (line {outcome.mutant.line})", flush=True)
            entries = [kept.entry() for kept in record]
            (options.out / "mutants.json").write_text(json.dumps(entries, indent=1))
    shutil.rmtree(_CACHE, ignore_errors=True)
    _report(record, options.out, time.monotonic() - start)
    sys.exit(any(outcome.verdict == "survived" for outcome in record))


def _report(record: Sequence[Outcome], out: Path, seconds: float) -> None:
    counts = Counter((outcome.room, outcome.verdict) for outcome in record)
    lines = [
        f"{len(record)} mutants in {seconds / 60:.0f} min",
        "",
        "| room | killed | survived |",
        "|---|---|---|",
    ]
    for room in dict.fromkeys(outcome.room for outcome in record):
        killed = counts[room, "killed"] + counts[room, "too slow"]
        lines.append(f"| {room} | {killed} | {counts[room, 'survived']} |")
    lines += ["", *(f"- {o.entry()['mutant']}" for o in record if o.verdict == "survived")]
    text = "\n".join(lines) + "\n"
    (out / "mutants.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
