"""Verdicts kept on disk, so that a sweep goes on where it stopped and runs nothing twice."""

import ast
import hashlib
import json
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from threading import Lock

from mutation.mutants import Mutant
from mutation.reach import digest, digest_of_code, digest_of_test, test_of
from mutation.rooms import ROOMS, drawn, test_files
from mutation.tree import ROOT

CAUGHT = ("killed", "too slow")
LIKELY = "likely"
"""Verdict of somebody who expects a test to catch a mutant, which was not run yet: it decides nothing."""
KEPT = Path(__file__).with_name("caught.json")
"""Mutants that tests catch, by which test, kept with the tests: a sweep begins with what caught it before."""
EQUIVALENTS = Path(__file__).with_name("equivalents.json")
MARK = "<!-- from here on by tests/mutation/run.py --write -->\n"
END = "<!-- to here -->\n"
HEAD = "| room | mutants | caught | equivalent | score |\n|---|---:|---:|---:|---:|\n"


@dataclass(frozen=True)
class Verdict:
    """Verdict on a mutant.

    verdict: killed, too slow, survived or likely; by: the test that failed, else how much was run;
    source: digest of the code of the file that is changed; tests: of the test that failed, else of all
    together
    """

    verdict: str
    by: str
    source: str
    tests: str


class Record:
    """Verdicts by mutant, and the tests that pass without one."""

    def __init__(self, file: Path, caught: Path = KEPT) -> None:
        """Take what is there; file: of those that survive."""
        self.file, self.caught = file, caught
        kept = json.loads(file.read_text()) if file.is_file() else {}
        self.verdicts = {key: Verdict(**entry) for key, entry in kept.get("survived", {}).items()}
        of_paths = json.loads(caught.read_text(encoding="utf-8")) if caught.is_file() else {}
        for path, changes in of_paths.items():
            self.verdicts |= {f"{path}: {change}": _read(told) for change, told in changes.items()}
        self.passed: dict[str, list[list[str]]] = kept.get("passed", {})
        """Tests that pass with a mutant, each with the digests of the changed file's code and of its own."""
        self.sound: dict[str, str] = {}
        self._saving = Lock()
        now = {name: digest(ROOT / name) for name in test_files()}
        texts = "".join(f"{name} {text}\n" for name, text in now.items())
        self.all_tests = hashlib.sha256(texts.encode()).hexdigest()[:16]
        self.suites: dict[str, dict[str, str]] = kept.get("suites", {}) | {self.all_tests: now}

    def tests(self, verdict: str, by: str) -> str:
        """Digest of the tests that a verdict rests on."""
        name, _, test = test_of(by).partition("::")
        file = ROOT / name
        if verdict not in CAUGHT or not by or not file.is_file():
            return self.all_tests
        return digest_of_test(file, test) if test else digest(file)

    def decided(self, mutant: Mutant) -> Verdict | None:
        """Verdict on a mutant for the texts as they are."""
        kept = self.verdicts.get(mutant.key)
        if kept is None or kept.source != digest_of_code(ROOT / mutant.path):
            return None
        return kept if kept.tests == self.tests(kept.verdict, kept.by) else None

    def caught_before(self, mutant: Mutant) -> str:
        """The test that caught a mutant of another text, or did so when it was another itself; else empty.

        Also that which is likely to catch it.
        """
        kept = self.verdicts.get(mutant.key)
        by = test_of(kept.by) if kept is not None and kept.verdict in (*CAUGHT, LIKELY) else ""
        return by if is_there(by) else ""

    def catches(self, path: str) -> Counter[str]:
        """Return how many changes each test caught; one of this file counts as ten, one near it as three."""
        found: Counter[str] = Counter()
        for key, kept in self.verdicts.copy().items():
            if kept.verdict in CAUGHT:
                other = key.partition(": ")[0]
                is_near = other.rpartition("/")[0] == path.rpartition("/")[0]
                found[test_of(kept.by)] += 10 if other == path else 3 if is_near else 1
        return found

    def survived(self, mutant: Mutant) -> set[str]:
        """Tests, and files of them, as they are now, that pass with this change of the text as it is."""
        kept, now = self.verdicts.get(mutant.key), self.suites[self.all_tests]
        source = digest_of_code(ROOT / mutant.path)
        found = {
            test
            for test, text, tests in self.passed.get(mutant.key, ())
            if text == source and is_there(test) and tests == self.tests("killed", test)
        }
        if kept is None or kept.verdict in CAUGHT or kept.source != source:
            return found
        return found | {
            name for name, text in self.suites.get(kept.tests, {}).items() if now.get(name) == text
        }

    def passes(self, mutant: Mutant, tests: Sequence[str]) -> None:
        """Keep that these tests pass with a change that is not decided; one that was likely is forgotten."""
        kept = self.verdicts.get(mutant.key)
        if kept is not None and kept.verdict == LIKELY and kept.by in tests:
            del self.verdicts[mutant.key]
        source = digest_of_code(ROOT / mutant.path)
        told = [[test, source, self.tests("killed", test)] for test in tests]
        self.passed.setdefault(mutant.key, []).extend(told)
        self.save()

    def add(self, mutant: Mutant, verdict: str, by: str) -> None:
        """Keep a verdict."""
        tests = self.tests(verdict, by)
        self.verdicts[mutant.key] = Verdict(verdict, by, digest_of_code(ROOT / mutant.path), tests)
        self.passed.pop(mutant.key, None)
        self.save()

    def save(self) -> None:
        """Write all to disk, each file at once."""
        caught: dict[str, dict[str, str]] = {}
        survived = {}
        for key, verdict in sorted(self.verdicts.copy().items()):
            path, _, change = key.partition(": ")
            if verdict.verdict in (*CAUGHT, LIKELY):
                told = f"{verdict.source} {verdict.tests} {verdict.verdict}: {verdict.by}"
                caught.setdefault(path, {})[change] = told
            else:
                survived[key] = asdict(verdict)
        suites = {kept.tests: self.suites.get(kept.tests, {}) for kept in self.verdicts.copy().values()}
        suites = {tests: files for tests, files in suites.items() if files}
        rest = {"survived": survived, "passed": self.passed.copy(), "suites": suites}
        for file, data in ((self.caught, caught), (self.file, rest)):
            with self._saving:
                beside = file.with_suffix(".new")
                beside.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
                beside.replace(file)

    def keep(self, keys: Collection[str]) -> None:
        """Forget all other mutants: of texts that have gone."""
        self.verdicts = {key: verdict for key, verdict in self.verdicts.items() if key in keys}
        self.passed = {key: tests for key, tests in self.passed.items() if key in keys}
        self.save()


def is_there(test: str) -> bool:
    """Return whether a file has this test, FILE::NAME."""
    file, _, name = test.partition("::")
    return bool(name) and (ROOT / file).is_file() and name in _tests_in(ROOT / file)


@cache
def _tests_in(file: Path) -> frozenset[str]:
    body = ast.parse(file.read_text(encoding="utf-8")).body
    return frozenset(node.name for node in body if isinstance(node, ast.FunctionDef))


def _read(told: str) -> Verdict:
    source, tests, rest = told.split(" ", 2)
    verdict, _, by = rest.partition(": ")
    return Verdict(verdict, by, source, tests)


@dataclass(frozen=True)
class Score:
    """Count of a room's verdicts."""

    room: str
    mutants: int
    caught: int
    equivalent: int
    survivors: tuple[str, ...]

    @property
    def open(self) -> int:
        """Mutants that are not decided yet."""
        return self.mutants - self.equivalent - self.caught - len(self.survivors)

    @property
    def row(self) -> str:
        """The room's line of the table; its score is of what is decided."""
        decided = self.caught + len(self.survivors)
        caught, score = (self.caught, f"{100 * self.caught / decided:.1f} %") if decided else ("–", "–")
        return f"| {self.room} | {self.mutants} | {caught} | {self.equivalent} | {score} |\n"


def explained() -> Mapping[str, str]:
    """Mutants that change nothing that is promised, with the reason."""
    found: dict[str, str] = json.loads(EQUIVALENTS.read_text(encoding="utf-8"))
    return found


def scores(record: Record, rooms: Sequence[str] = tuple(ROOMS)) -> list[Score]:
    """Yield the score of each room, for the texts as they are."""
    reasons = explained()
    found = []
    for room in rooms:
        mutants = drawn(room)
        rest = [mutant for mutant in mutants if mutant.key not in reasons]
        verdicts = [(mutant.key, record.decided(mutant)) for mutant in rest]
        caught = sum(verdict is not None and verdict.verdict in CAUGHT for _, verdict in verdicts)
        survivors = tuple(k for k, v in verdicts if v is not None and v.verdict == "survived")
        found.append(Score(room, len(mutants), caught, len(mutants) - len(rest), survivors))
    return found


def table(found: Sequence[Score]) -> str:
    """The scores as docs/trust.md has them."""
    return HEAD + "".join(score.row for score in found)


def total(found: Sequence[Score]) -> str:
    """The scores in a line."""
    mutants, caught = sum(score.mutants for score in found), sum(score.caught for score in found)
    left, reasons = sum(len(score.survivors) for score in found), sum(score.equivalent for score in found)
    told = f"{caught:,} caught, {left} survive, {reasons} explained"
    return f"{mutants:,} changes in {len(found)} rooms: {told}"


def written(page: str, found: Sequence[Score]) -> str:
    """The page with the table in its place."""
    before, _, rest = page.partition(MARK)
    _, _, after = rest.partition(END)
    return before + MARK + table(found) + END + after
