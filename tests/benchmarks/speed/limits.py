"""What the machine can do at most."""

from collections.abc import Iterable
from pathlib import Path

from speed.package import PEERS, build_flags, compiler, pairs, run


def limits(work: Path, sizes: Iterable[int]) -> dict[str, float]:
    """GFlop/s of additions and multiplications in registers, GB/s of writing arrays of the given bytes."""
    program = work / "limits"
    run([compiler() or "cc", "-std=c99", *build_flags(), str(PEERS / "limits.c"), "-o", str(program)])
    return pairs(run([str(program), *(str(size) for size in sorted(set(sizes)))]))
