"""Input of every back end's emitter."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from linkwise.dynamics.link_forms import LinkForms
from linkwise.package.entries import KernelKind
from linkwise.symbolic.system import System


@dataclass(frozen=True)
class Derivation:
    """Input of every back end: the system, the closed forms of each link, and the request that led to it.

    Rigid bodies alone can do without closed forms; the package's kernel is in loops then.
    """

    system: System
    forms: tuple[LinkForms, ...]
    package: str
    request: Mapping[str, Any]
    vendor_runtime: bool = False
    """True if the package carries a copy of what it imports of linkwise_runtime."""

    @property
    def nonquadratic(self) -> frozenset[int]:
        """Links with terms that are not quadratic in the velocities, whose ∂τ/∂q̇ is not 2 c1."""
        return frozenset(j for j, forms in enumerate(self.forms) if forms.velocity_excess)

    @property
    def kernel(self) -> KernelKind:
        """Kernel of the package."""
        return "straight" if self.forms else "loops"
