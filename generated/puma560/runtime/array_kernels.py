"""Which of its two kernels a back end of arrays takes: closed forms, straight on, or the vectorised rule.

Closed forms do the fewest additions and multiplications, one array operation each: thousands, whose calls
cost more than their work unless the batch is large. The rule does more in a hundred and fifty or so. Which
is quicker hangs on the robot, by the packed numbers of one sample, and on the batch;
`tests/benchmarks/kernel_crossing.py` measures it and prints the tables that the back ends keep.
"""

from collections.abc import Mapping
from typing import Any

Crossing = tuple[tuple[int, int], ...]
"""Rows (packed numbers of a sample, largest batch in which the rule is quicker), by rising numbers."""
KERNELS = ("auto", "straight", "rule")


def known_kernel(kernel: str, straight: bool, rule: bool, bodies: bool) -> str:
    """The kernel to take, auto where both remain; raises ValueError for one that cannot be.

    straight, rule: whether the package has closed forms and the rule; bodies: whether bodies are given
    """
    if kernel not in KERNELS:
        raise ValueError(f"no kernel {kernel!r}; choose one of {', '.join(KERNELS)}")
    if bodies and not rule:
        raise ValueError("this package is of energies, which have no bodies; leave bodies out")
    if bodies and kernel == "straight":
        raise ValueError("closed forms hold the package's own bodies; take kernel='rule' with bodies")
    if kernel == "straight" and not straight:
        raise ValueError(
            "this package has no closed forms; take kernel='rule', or generate it with --kernel straight"
        )
    if kernel == "rule" and not rule:
        raise ValueError("this package is of energies, which have closed forms alone; take kernel='straight'")
    if bodies or not straight:
        return "rule"
    return kernel if rule else "straight"


def refuse_choice(backend: str, kernel: str, bodies: Any) -> None:
    """Raise ValueError where a back end with one way to compute is asked for another."""
    if kernel != "auto":
        raise ValueError(f"{backend} has no kernels to choose from; leave kernel out, or load numpy or torch")
    if bodies is not None:
        raise ValueError(f"{backend} computes with the package's own bodies; load numpy or torch with bodies")


def rule_is_quicker(crossings: Mapping[str, Crossing], call: str, numbers: int, samples: int) -> bool:
    """Whether the rule is to be taken for a call, a robot of so many packed numbers, and a batch."""
    most = 0
    for size, batch in crossings[call]:
        if size <= numbers:
            most = batch
    return samples <= most
