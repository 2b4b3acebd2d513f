"""The verdict on one mutant: tests that may notice it, quick ones first, until one fails.

A test that fails without the mutant too, or passes when it runs again, decides nothing: it is told and
left out.
"""

from collections.abc import Collection, Iterator
from itertools import chain, islice
from threading import Lock
from typing import Literal

from mutation.mutants import Mutant
from mutation.order import in_order
from mutation.reach import Map, digest
from mutation.rooms import NOT_COUNTED, ROOMS
from mutation.tree import ROOT, Ended, Tree, say
from mutation.verdicts import Record

STAGES = (10.0, 40.0, 160.0)
"""Seconds of tests, as the map has measured them, of the processes that a mutant is put to in turn.

All that are left are put to the first before any goes on to the second.
"""
BESIDE = 40.0
"""Seconds of the other tests of the same files."""
UNKNOWN = 300.0
"""Seconds for a file that a room names, which no map has measured: new ones, and those of `make ship`."""
UNMEASURED = 15.0
"""Seconds for a test that caught a change before, where no map has measured it yet."""
Depth = Literal["before", "first", "all"]
"""To which tests a mutant is put: what caught it before; if it passes none yet, the first stage; all."""


def _is_new(test: str, tried: Collection[str]) -> bool:
    """Return whether a test counts, and neither it nor its file is among those that were tried."""
    is_tried = test in tried or test.partition("::")[0] in tried
    return not is_tried and not any(test.startswith(left) for left in NOT_COUNTED)


class Decider:
    """Decides mutants."""

    def __init__(self, reach: Map, record: Record) -> None:
        """Take the map of what tests reach and the record of what is known."""
        self.reach = reach
        self.record = record
        self.unsteady: dict[str, str] = {}
        self._lock = Lock()

    def stages(self, room: str, mutant: Mutant) -> Iterator[tuple[list[str], float]]:
        """Tests of each process, and their seconds: what reaches the change, else what the room names.

        First what has caught most of other changes in its seconds, above all in the same file. What it
        is known to survive is left out. Last what the room names and no map has measured, as of `make ship`.
        """
        tried = self.record.survived(mutant)
        parts = self.reach.tests(mutant.path, mutant.line) if mutant.path.endswith(".py") else ([], [])
        caught, limits = self.record.catches(mutant.path), STAGES
        openings = {name: reached.opening for name, reached in self.reach.files.items()}
        near, far, last = (
            in_order([one for one in part if _is_new(one[0], tried)], caught, openings)
            for part in (*parts, self._named(room))
        )
        if not parts[0]:
            near, limits, last = last, (*STAGES[:2], float("inf")), []
        close, beside = iter(near), iter(far)
        apart = (item for item in last if item[0] in ROOMS[room].tests)
        every = (*((close, limit) for limit in limits), (beside, BESIDE), (apart, float("inf")))
        for ranked, limit in every:
            tests: list[str] = []
            total = 0.0
            for name, seconds in ranked:
                tests.append(name)
                total += seconds
                if total >= limit:
                    break
            if tests:
                yield tests, total

    def before(self, mutant: Mutant) -> Iterator[tuple[list[str], float]]:
        """The test that caught a change before, with its seconds; none where the change passes it now."""
        before = self.record.caught_before(mutant)
        if before and _is_new(before, self.record.survived(mutant)):
            known = self.reach.files.get(before.partition("::")[0])
            yield [before], known.seconds.get(before, UNMEASURED) if known else UNMEASURED

    def _named(self, room: str) -> list[tuple[str, float]]:
        """Tests of the files that a room names, with their seconds."""
        found = []
        for name in ROOMS[room].tests:
            known = self.reach.files.get(name)
            found += list(known.own.items()) if known and known.seconds else [(name, UNKNOWN)]
        return found

    def decide(self, room: str, mutant: Mutant, tree: Tree, depth: Depth = "all") -> tuple[str, str] | None:
        """Killed, too slow or survived; and by which test, or after how many seconds of tests.

        None where the tests so far pass and it is put to others later.
        """
        if depth == "first" and self.record.survived(mutant):
            return None
        total = 0.0
        most = {"before": 0, "first": 1, "all": None}[depth]
        for tests, seconds in chain(self.before(mutant), islice(self.stages(room, mutant), most)):
            total += seconds
            if verdict := self._caught(mutant, tests, seconds, tree):
                return verdict
            self.record.passes(mutant, tests)
        if depth != "all":
            return None
        kept = self.record.verdicts.get(mutant.key)
        if not total and kept and kept.verdict == "survived":
            return "survived", kept.by
        if not total and self.record.survived(mutant):
            return "survived", "all that reach it"
        return "survived", f"{total:.0f} s of tests" if total else "nothing reaches it"

    def _caught(self, mutant: Mutant, tests: list[str], seconds: float, tree: Tree) -> tuple[str, str] | None:
        """Killed or too slow, and by which test; None where all of them pass that can be trusted."""
        while tests := [one for one in tests if one.partition("::")[0] not in self.unsteady]:
            left = [*(name for name in NOT_COUNTED if "::" in name), *self.unsteady]
            with tree.changed(mutant):
                ended = tree.tested(tests, 60 + 4 * seconds, left)
            if ended.passed:
                return None
            if self._trusted(ended, tests, seconds, left, tree):
                return ("too slow" if ended.too_slow else "killed"), ended.by or tests[0]
            if not ended.by:
                raise SystemExit(f"{' '.join(tests)} end with {ended.code} without a mutant, too")
        return None

    def _trusted(self, ended: Ended, tests: list[str], seconds: float, left: list[str], tree: Tree) -> bool:
        """Return whether what failed fails because of the mutant; if not, it is told and does not count any
        more."""
        if ended.by and not ended.again:
            self._leave(ended.by, "failed, and passed when it was run again")
            return False
        file = ROOT / ended.by.partition("::")[0]
        known = digest(file) if ended.by and file.is_file() else ""
        if ended.by and self.record.sound.get(ended.by) == known:
            return True
        without = tree.tested([ended.by] if ended.by else tests, 60 + 4 * seconds, left)
        if not without.passed:
            if ended.by:
                self._leave(ended.by, "fails without a mutant")
            return False
        if ended.by:
            with self._lock:
                self.record.sound[ended.by] = known
        return True

    def _leave(self, name: str, why: str) -> None:
        with self._lock:
            self.unsteady[name] = why
        say(f"no verdict by {name}: {why}")
