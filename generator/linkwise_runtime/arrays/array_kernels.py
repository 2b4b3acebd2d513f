"""Choice between the two kernels of a back end of arrays: straight closed forms, or the vectorised rule.

Closed forms need the fewest additions and multiplications, one array operation each: thousands, whose calls
cost more than their work unless the batch is large. The rule needs more of them in a hundred or so array
operations, on spatial matrices for few samples, and with samples innermost for many. Which one is faster
depends on the operations of the closed forms and on the batch; `tests/benchmarks/kernel_crossing.py` measures
it and prints the tables that the back ends keep.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..interface import ClosedForms

Rows = tuple[tuple[int, int], ...]
"""(size of a robot, largest batch for which something is faster), by rising sizes."""


def largest_batch(rows: Rows, size: int) -> int:
    """Return the largest batch for a robot of a size, from the last row not above it; 0 below the first."""
    return next((most for least, most in reversed(rows) if least <= size), 0)


class Crossing(NamedTuple):
    """Range in which the rule is faster than closed forms, by the number of operations of these."""

    alone: int
    """Number of operations from which on the rule is faster for one sample of shape (n,): closed forms then
    compute with numbers, not arrays."""
    batches: Rows

    def rule_is_quicker(self, operations: int, batch: tuple[int, ...]) -> bool:
        """Return whether the rule is faster for so many operations and samples of shape `batch`."""
        if not batch:
            return operations >= self.alone
        return math.prod(batch) <= largest_batch(self.batches, operations)


KERNELS = ("auto", "straight", "rule")


def known_kernel(kernel: str, straight: bool, rule: bool, bodies: bool) -> str:
    """Return the kernel to use, auto where both remain; raise ValueError for one that cannot be used.

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


def refuse_choice(backend: str, kernel: str, bodies: object) -> None:
    """Raise ValueError where a back end with one way to compute is asked for another."""
    if kernel != "auto":
        raise ValueError(f"{backend} has no kernels to choose from; leave kernel out, or load numpy or torch")
    if bodies is not None:
        raise ValueError(f"{backend} computes with the package's own bodies; load numpy or torch with bodies")


def refuse_learning(backend: str, requires_grad: object) -> None:
    """Raise ValueError where a back end without torch modules is asked for nn.Parameters."""
    if not isinstance(requires_grad, bool) or requires_grad:
        raise ValueError(
            f"{backend} has no torch modules; load autograd with requires_grad, or torch with tensors that "
            "require a gradient as parameters or bodies"
        )


def operations(links: Sequence[ClosedForms]) -> Mapping[str, int]:
    """Return the number of operations of each call of the closed forms."""
    calls = ("decomposition", "torque", "position_gradient")
    return {call: sum(link.OPERATIONS[call] for link in links) for call in calls}
