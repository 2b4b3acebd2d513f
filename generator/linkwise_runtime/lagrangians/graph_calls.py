"""What `Dynamics.graph` and `Dynamics.graph_parts` answer on the autograd back end."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

from torch import Tensor

from ..chosen_names import whole_number
from ..recorded.recorded_torques import LinkEnergies, Part
from .graph_leaves import seen_as_leaves
from .torque_graph import TorqueGraph, torque_graphs

Name = int | str
Links = Name | Iterable[Name] | None
ORDERS = "2 for acceleration, 1 for velocity, 0 for position and gravity"


def graph_of(backend: Any, i: Name, j: Links, k: Name | None, m: int | None) -> TorqueGraph:
    """See `Dynamics.graph`."""
    joint, through = _place(backend, i, j)
    order = None if m is None else whole_number(m)
    if order not in (0, 1, 2) and m is not None:
        raise ValueError(f"m is {m!r}; choose {ORDERS}, or leave it away for all of them")
    coordinate = None if k is None else backend.structure.joint_index(k, "k")
    return torque_graphs(backend, _energies(backend), joint, through, [(coordinate, order)])[0]


def graph_parts_of(backend: Any, i: Name, j: Links) -> tuple[TorqueGraph, ...]:
    """See `Dynamics.graph_parts`."""
    joint, through = _place(backend, i, j)
    paths = [path for at in through if joint in (path := backend.structure.paths[at])]
    coordinates = sorted({k for path in paths for k in path})
    parts: list[Part] = [(k, m) for m in (2, 1) for k in coordinates]
    found = torque_graphs(backend, _energies(backend), joint, through, [*parts, (None, 0)])
    return tuple(one for one in found if one.output != 0.0)


def _energies(backend: Any) -> Any:
    def links(values: Mapping[str, Tensor]) -> list[LinkEnergies]:
        p = seen_as_leaves(backend, values)
        return [
            LinkEnergies(link.path, link.linear, partial(link.kinetic, p=p), partial(link.potential, p=p))
            for link in backend.modules
        ]

    return links


def _place(backend: Any, i: Name, j: Links) -> tuple[int, tuple[int, ...]]:
    structure = backend.structure
    joint = structure.joint_index(i, "i")
    if j is None:
        return joint, tuple(range(structure.N))
    single = isinstance(j, str) or whole_number(j) is not None
    chosen: Any = (j,) if single else j
    through = tuple(structure.link_index(link, "j") for link in chosen)
    for at, link in enumerate(through):
        if link in through[:at]:
            raise ValueError(f"j names link {structure.link_names[link]} twice; give each link once")
    return joint, through
