"""Timing of calls by turns, so that what disturbs the machine disturbs all of them alike."""

import time
from collections.abc import Callable, Mapping
from typing import Any

SPELL = 2e5
"""Nanoseconds that a quick call is repeated for before the next one has its turn."""


def by_turns(calls: Mapping[str, Callable[[], Any]], seconds: float) -> dict[str, float]:
    """Least nanoseconds of one call of each, over as many rounds as the seconds for each of them hold."""
    least = {name: min(spell(call, 1) for _ in range(4)) for name, call in calls.items()}
    inner = {name: max(1, int(SPELL / ns)) for name, ns in least.items()}
    end = time.perf_counter() + seconds * len(calls)
    rounds = 0
    while rounds < 3 or time.perf_counter() < end:
        for name, call in calls.items():
            least[name] = min(least[name], spell(call, inner[name]))
        rounds += 1
    return least


def spell(call: Callable[[], Any], inner: int) -> float:
    """Nanoseconds a call, of some calls one after another."""
    start = time.perf_counter_ns()
    for _ in range(inner):
        call()
    return (time.perf_counter_ns() - start) / inner
