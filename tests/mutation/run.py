"""Mutation testing of the whole house: what may be wrong without a test noticing?

    python tests/mutation/run.py --out out/mutate [--minutes 30] [--only dynamics emit] [--jobs 2] [--write]

Each mutant runs in a process forked from one that has the heavy libraries, in a copy of the tree. It is
killed when a test that may notice it fails, or takes far more processor time than without it. What survives
is to be killed by a test, or listed in equivalents.json with the reason why nothing that is promised changes.
First each is put to the test that caught it when its file was another, or that caught.json has as likely
to, as in "- - likely: tests/FILE.py::NAME". For what is left, files of tests that are new run once under
coverage, which tells what they reach; then each is put to a few tests that reach it, and at last to many.
--minutes ends the sweep, and the next one goes on from there, in any clone: what is caught is in caught.json.
--write puts the scores into docs/trust.md.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import TypeVar

sys.path.insert(0, str(Path(__file__).parents[1]))

from mutation.decide import Decider, Depth
from mutation.mutants import Mutant
from mutation.reach import Map
from mutation.rooms import ROOMS, drawn, test_files
from mutation.tree import ROOT, Tree, load_heavy, say
from mutation.verdicts import Record, explained, scores, table, total, written

PAGE = ROOT / "docs/trust.md"
Item = TypeVar("Item")


def in_turn(rooms: Sequence[str], record: Record) -> list[tuple[str, Mutant]]:
    """Mutants to decide, rooms in turn, so that a sweep that is cut short has seen of each its share."""
    reasons = explained()
    ranked = []
    for room in rooms:
        found = drawn(room)
        todo = [(k, m) for k, m in enumerate(found) if m.key not in reasons and record.decided(m) is None]
        ranked += [(k / len(found), room, mutant) for k, mutant in todo]
    return [(room, mutant) for _, room, mutant in sorted(ranked, key=lambda item: item[0])]


def side_by_side(
    items: Sequence[Item], work: Callable[[Item, Tree], None], trees: Sequence[Tree], end: float
) -> Iterator[Item]:
    """Each item when its work is done, in a tree of its own; none is begun after the end."""
    free: SimpleQueue[Tree] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def one(item: Item) -> Item | None:
        if time.monotonic() > end:
            return None
        tree = free.get()
        try:
            work(item, tree)
        finally:
            free.put(tree)
        return item

    pool = ThreadPoolExecutor(len(trees))
    try:
        yield from (item for item in pool.map(one, items) if item is not None)
    except BaseException:
        for tree in trees:
            tree.stop()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def swept(options: argparse.Namespace) -> bool:
    """Map, decide, and say whether all is decided and every test that failed could be trusted."""
    end = time.monotonic() + 60 * options.minutes
    reach, record = Map(options.out / "reach"), Record(options.out / "survived.json")
    decider = Decider(reach, record)
    load_heavy()
    with tempfile.TemporaryDirectory() as folder:
        trees = [Tree(Path(folder) / str(k)) for k in range(options.jobs)]
        unknown = [name for name in test_files() if name not in reach.files]
        every = todo = in_turn(options.only, record)
        depths: tuple[Depth, ...] = ("before", "first", "all")
        for depth in depths:
            for name in side_by_side(unknown if depth == "first" else [], reach.add, trees, end):
                say(f"mapped: {name}")

            def decide(item: tuple[str, Mutant], tree: Tree, depth: Depth = depth) -> None:
                room, mutant = item
                if verdict := decider.decide(room, mutant, tree, depth):
                    record.add(mutant, *verdict)
                    if verdict[0] == "survived":
                        say(f"survives: {mutant.key} (line {mutant.line}; {verdict[1]})")

            for _ in side_by_side(todo, decide, trees, end):
                pass
            todo = in_turn(options.only, record)
            say(f"{len(every) - len(todo)} of {len(every)} mutants decided")
            if not todo or time.monotonic() > end:
                break
    return not todo and not decider.unsteady


def main() -> None:
    """Run, report, and fail where a mutant survives that nobody has explained."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out/mutate"))
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--only", nargs="*", default=list(ROOMS), choices=list(ROOMS), metavar="ROOM")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--write", action="store_true", help="the table of docs/trust.md, from what is decided"
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.write:
        record = Record(options.out / "survived.json")
        found = scores(record)
        if waiting := sum(score.open for score in found):
            sys.exit(f"{waiting} mutants are not decided yet: run `make mutate` before --write")
        record.keep({mutant.key for room in ROOMS for mutant in drawn(room)})
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), found), encoding="utf-8")
        return
    try:
        whole = swept(options)
    except KeyboardInterrupt:
        sys.exit("interrupted; the next run goes on from here")
    found = scores(Record(options.out / "survived.json"), options.only)
    report = "\n".join([table(found), *(f"- {key}" for score in found for key in score.survivors)]) + "\n"
    (options.out / "mutants.md").write_text(report, encoding="utf-8")
    print(report + total(found))
    sys.exit(not whole or any(score.survivors for score in found))


if __name__ == "__main__":
    main()
