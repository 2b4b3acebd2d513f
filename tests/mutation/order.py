"""The order in which a mutant is put to tests: first what has caught most of others in its seconds.

What fixtures of many tests take counts once for each file. Tests of a file stand together as long as the next
one makes the catches per second more.
"""

import heapq
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import accumulate

START = 0.1
"""Seconds that each test takes beside its own."""

Timed = tuple[str, float]
"""A test and seconds."""


def in_order(tests: Sequence[Timed], caught: Counter[str], openings: Mapping[str, float]) -> list[Timed]:
    """Tests in order with the seconds of each, those before the first of its file too.

    tests: with their own seconds; caught: how often each has caught a change; openings: seconds, by file
    """
    files: dict[str, list[Timed]] = {}
    for name, seconds in sorted(tests, key=lambda item: -(1 + caught[item[0]]) / (item[1] + START)):
        files.setdefault(name.partition("::")[0], []).append((name, seconds))

    def next_of(file: str, opening: float) -> tuple[float, int, str, float]:
        """Return minus the catches per second of the next tests of a file, and how many these are."""
        gains = accumulate(1 + caught[name] for name, _ in files[file])
        costs = accumulate((seconds + START for _, seconds in files[file]), initial=opening)
        next(costs)
        worth = [gain / cost for gain, cost in zip(gains, costs, strict=True)]
        best = max(range(len(worth)), key=worth.__getitem__)
        return -worth[best], best + 1, file, opening

    waiting = [next_of(file, openings.get(file, 0.0)) for file in files]
    heapq.heapify(waiting)
    found: list[Timed] = []
    while waiting:
        _, count, file, opening = heapq.heappop(waiting)
        (name, seconds), *more = files[file][:count]
        found += [(name, opening + seconds), *more]
        files[file] = files[file][count:]
        if files[file]:
            heapq.heappush(waiting, next_of(file, 0.0))
    return found
