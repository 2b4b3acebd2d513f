"""Input of every back end's emitter."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from linkwise.dynamics.kernel import Kernel
from linkwise.package.entries import KernelKind
from linkwise.symbolic.system import System


@dataclass(frozen=True)
class Derivation:
    """Input of every back end: the system, one kernel per link, and the request that led to it.

    Without kernels, which rigid bodies alone can do, the package's kernel is in loops.
    """

    system: System
    kernels: tuple[Kernel, ...]
    package: str
    request: Mapping[str, Any]
    vendor_runtime: bool = False
    """True if the package carries a copy of what it imports of linkwise_runtime."""

    @property
    def linear(self) -> frozenset[int]:
        """Links whose energy has terms linear in the velocities."""
        return frozenset(j for j, k in enumerate(self.kernels) if k.forms[0].velocity_linear)

    @property
    def kernel(self) -> KernelKind:
        """Kind of the package's kernel."""
        return "straight" if self.kernels else "loops"
