"""The Lagrangian of a rigid link, and the numbers that it owns."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

from ..arrays.run_time_values import RunTimeValues, hold
from ..structure import Structure
from .energy_interface import Parameters
from .partial_lagrangian import PartialLagrangian


class RigidLagrangian(PartialLagrangian):
    """Lagrangian of a rigid link; a subclass lists its numbers in `constants`.

    They are float64 buffers of the module, or nn.Parameters where they are `learned`, by these names:

    mass     in kg, shape ()
    com      centre of mass in m, (3,)
    inertia  about the centre of mass in kg m^2, (3, 3); of it the symmetric part counts
    place    of its joint in the frame of the link before it, in m, (3,); place_a, place_b, ... where joints
             without a body lie between them

    What hangs on run-time parameters is not listed: the subclass works it out of these.
    """

    constants: ClassVar[Mapping[str, Any]] = {}
    places: ClassVar[Mapping[int, str]] = {}
    """Joints, as tree.py counts them, whose place is one of these constants, and its name."""

    def __init__(
        self, alone: Structure, given: RunTimeValues, before: Any, learned: Collection[str] = ()
    ) -> None:
        super().__init__(alone, given, before)
        for name, value in self.constants.items():
            hold(self, name, value, name.partition("_")[0] in learned)

    def body(self, p: Parameters) -> Sequence[Any]:
        """Mass, centre of mass and inertia: numbers, or tensors where somebody differentiates by them."""
        own = p.constants(self)
        return own["mass"], own["com"], own["inertia"]
