"""Broken robots, logs, manifests and command lines by the thousand: `make fuzz`.

Each case is named by its kind and its seed. Like findings are told once, and how often they came; the first
is kept with its files in `--out`, and `--kind KIND --first SEED --count 1` runs it again.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from fuzz.case import Case
from fuzz.cases import KINDS, WEIGHTS, case_of
from fuzz.client import Client
from fuzz.worker import Outcome


@dataclass
class Tally:
    """Count of what was run and found; the first finding of each sort is printed and kept in `folder` as it
    comes."""

    folder: Path
    ends: Counter[tuple[str, int | None]] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)

    def add(self, kind: str, seed: int, case: Case, outcome: Outcome) -> None:
        """Count a case."""
        self.ends[kind, outcome.status] += 1
        if not outcome.faults:
            return
        sort = f"{kind}: {outcome.place or outcome.faults[0][:60]}"
        if not self.found[sort]:
            again = f"--kind {kind} --first {seed} --count 1"
            print(f"{sort}\n  {again}: {'; '.join(outcome.faults)[:300]}", flush=True)
            self._keep(f"{kind}-{seed}", case, outcome)
        self.found[sort] += 1

    def _keep(self, name: str, case: Case, outcome: Outcome) -> None:
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in case.files.items():
            (folder / Path(file).name).write_bytes(content)
        words = "linkwise " + " ".join(map(repr, case.arguments))
        told = "\n".join([words, *outcome.faults, outcome.message[:3000], outcome.trace])
        (folder / "finding.txt").write_text(told + "\n", encoding="utf-8", errors="backslashreplace")

    def summary(self, seconds: float) -> str:
        """Return how often each was found, and how many cases there were."""
        lines = [f"{count:>7} × {sort}" for sort, count in self.found.most_common()]
        for kind in dict.fromkeys(kind for kind, _ in self.ends):
            count = sum(number for (which, _), number in self.ends.items() if which == kind)
            lines.append(f"{count:>7} {kind}, of which {self.ends[kind, 2]} refused")
        sorts, all_found = len(self.found), self.found.total()
        where = f" of {sorts} sorts; see {self.folder}" if sorts else ""
        return "\n".join(
            [*lines, f"{self.ends.total()} cases in {seconds:.0f} s: {all_found} findings{where}"]
        )


def in_turn(kinds: list[str], first: int, count: int) -> Iterator[tuple[str, int]]:
    """(kind, seed), so many of each kind, mixed by their weights."""
    seeds = {kind: iter(range(first, first + count)) for kind in kinds}
    while seeds:
        for kind in list(seeds):
            taken = list(islice(seeds[kind], WEIGHTS.get(kind, 1)))
            yield from ((kind, seed) for seed in taken)
            if not taken:
                del seeds[kind]


def main() -> int:
    """Run; exit status 1 where something was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long")
    parser.add_argument(
        "--count", type=int, default=0, help="cases of each kind; 0: as many as there is time for"
    )
    parser.add_argument("--kind", choices=KINDS, action="append", help="may be repeated; all if not given")
    parser.add_argument("--first", type=int, default=0, help="seed of the first case")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"), help="folder of the findings")
    arguments = parser.parse_args()
    tally = Tally(arguments.out)
    start, end = time.monotonic(), time.monotonic() + 60.0 * arguments.minutes
    cases = in_turn(arguments.kind or list(KINDS), arguments.first, arguments.count or sys.maxsize)
    with Client() as client:
        for kind, seed in cases:
            case = case_of(kind, seed)
            tally.add(kind, seed, case, client.run(case))
            if time.monotonic() > end:
                break
    print(tally.summary(time.monotonic() - start))
    return int(bool(tally.found))


if __name__ == "__main__":
    sys.exit(main())
