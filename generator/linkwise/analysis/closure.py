"""How well the parts of a result sum to the whole."""

from dataclasses import asdict, dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.errors import LinkwiseError

LIMIT = 1e-9
"""A relative error above this is no rounding: the package does not compute what it says."""

AGAINST_RECURSION = 1e-6
"""The same against another way of computing, whose rounding is another."""


@dataclass(frozen=True)
class Closure:
    """Largest errors of Σ_k τp_ij + g_ij against τ_ij (terms) and of Σ_j τ_ij against τ_i (links).

    Absolute in N·m (N), relative to the largest sum of magnitudes in the same block of samples. Packages
    may sum τ_i from the τ_ij, so both sums say only that nothing was lost; `recursion` is the largest
    error of τ_ij against an independent Newton–Euler recursion, None where the energies are hand-written.
    """

    terms_absolute: float = 0.0
    terms_relative: float = 0.0
    links_absolute: float = 0.0
    links_relative: float = 0.0
    recursion_absolute: float | None = None
    recursion_relative: float | None = None

    def __or__(self, other: "Closure") -> "Closure":
        """The larger of both, error by error."""
        a, b = asdict(self), asdict(other)
        return Closure(**{name: _larger(a[name], b[name]) for name in a})

    def check(self) -> None:
        """Raise LinkwiseError where the parts do not sum to the whole."""
        worst = np.maximum(self.terms_relative, self.links_relative)
        if not worst <= LIMIT:
            raise LinkwiseError(
                f"the robot's torques do not close (relative error {worst:.2g}); run `linkwise check` on it"
            )
        if self.recursion_relative is not None and not self.recursion_relative <= AGAINST_RECURSION:
            raise LinkwiseError(
                "the robot's partial torques are not those of the Newton-Euler recursion (relative error"
                f" {self.recursion_relative:.2g}); run `linkwise check` on it"
            )


def _larger(a: Any, b: Any) -> Any:
    if a is None or b is None:
        return b if a is None else a
    return float(np.maximum(a, b))  # unlike Python's max, it lets no NaN pass unseen


def residual(parts: list[NDArray[np.float64]], whole: NDArray[np.float64]) -> tuple[float, float]:
    """Largest |Σ parts - whole| over samples, and the largest Σ |parts|."""
    if not parts:
        return float(np.abs(whole).max(initial=0.0)), 0.0
    error = reduce(np.add, parts) - whole
    scale = reduce(np.add, map(np.abs, parts))
    return float(np.abs(error).max(initial=0.0)), float(scale.max(initial=0.0))


def relative(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    """Largest error of (error, scale) pairs, absolute and relative to the largest scale."""
    error, scale = np.max(np.array([(0.0, 0.0), *pairs]), axis=0).tolist()
    return error, error / scale if scale else error
