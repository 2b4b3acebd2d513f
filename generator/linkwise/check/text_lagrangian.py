"""A link's Lagrangian from the text of the energies that a manifest gives, for torch to differentiate."""

from collections.abc import Mapping
from typing import Any

from linkwise.check.text_reader import TextFormula, parameter_values, torch_functions
from linkwise.extras import extra
from linkwise.package.entries import EnergyEntry


class TextLagrangian:
    """L(q, qd) of one link, for q and qd of shape (n,); raises Unreadable for text that is no formula."""

    def __init__(self, energies: EnergyEntry, parameters: Mapping[str, float]) -> None:
        torch = extra("torch")
        self._kinetic, self._potential = TextFormula(energies.kinetic), TextFormula(energies.potential)
        self._parameters = {
            name: torch.tensor(value, dtype=torch.float64)
            for name, value in parameter_values(parameters).items()
        }

    def __call__(self, q: Any, qd: Any) -> Any:
        """Value in J, without an axis."""
        names = dict(self._parameters)
        for kind, motion in (("q", q), ("qd", qd)):
            names |= {f"{kind}_{k}": motion[k - 1] for k in range(1, len(motion) + 1)}
        functions = torch_functions()
        value = self._kinetic.value(names, functions) - self._potential.value(names, functions)
        return q.new_zeros(()) + value  # a constant is a tensor, too
