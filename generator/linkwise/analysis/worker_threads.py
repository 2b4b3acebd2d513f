"""Number of threads that compute: one for each core that this process may use."""

import os

LIMIT = "OMP_NUM_THREADS"
"""Variable that limits threads of many programs, ours too; workers of a study have it set to 1."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def worker_threads() -> int:
    """Return the number of threads that compute blocks of a result, at most `LIMIT` where that is set."""
    told = os.environ.get(LIMIT, "")
    return max(1, min(cores(), int(told))) if told.isdecimal() else cores()
