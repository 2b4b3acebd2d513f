"""The autograd graph of a partial torque, or of a part of it, to hold, to count and to run."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

import torch
from torch import Tensor

from ..recorded.operation_recorder import Leaf, Operation, Ref, mapped
from ..recorded.recorded_torques import LinkEnergies, Part, RecordedParts, record
from ..structure import Structure
from .graph_leaves import learned_entries, leaves_beside_motion


@dataclass(frozen=True, eq=False, repr=False)
class TorqueGraph:
    """Operations of torch, and the motions and parameters that they start from, up to a torque in N m or N.

    Keys of leaves and operations are the same in every graph, so that graphs can be laid over each other.
    """

    joint: str
    """Joint i that is loaded."""
    links: tuple[str, ...]
    """Links j through which it is loaded: one, or all."""
    coordinate: str | None
    """Joint k whose motion the part is due to; None for all."""
    order: int | None
    """2 acceleration, 1 velocity; 0 position, without a coordinate gravity; None for all orders."""
    leaves: tuple[Leaf, ...]
    """Motions and parameters that are connected with the torque."""
    operations: tuple[Operation, ...]
    """Operands first."""
    output: str | float
    """Key of the torque; a number where it is constant, 0.0 above all."""
    backend: Any
    """What checks the motion and has the parameters' values."""

    def __repr__(self) -> str:
        """Which torque or part of it, and how large; the operations themselves are in `operations`."""
        words = {None: "motion", 0: "position", 1: "velocity", 2: "acceleration"}
        every = {None: "", 0: ", gravity", 1: ", all velocities", 2: ", all accelerations"}
        part = every[self.order] if self.coordinate is None else f", {words[self.order]} of {self.coordinate}"
        through = ", ".join(self.links) if len(self.links) <= 3 else f"{len(self.links)} links"
        sizes = f"{len(self.operations)} operations, {len(self.leaves)} leaves"
        return f"<TorqueGraph: torque on {self.joint} through {through}{part}: {sizes}>"

    def __copy__(self) -> "TorqueGraph":
        """Itself: nothing of it can be changed."""
        return self

    def __reduce_ex__(self, protocol: Any) -> NoReturn:
        raise TypeError(
            "a TorqueGraph holds functions of torch, which are neither pickled nor copied deeply; pickle or "
            "copy the robot, and ask it for the graph again with graph(i, j, k, m)"
        )

    @property
    def nodes(self) -> tuple[Leaf | Operation, ...]:
        """Leaves, then operations."""
        return *self.leaves, *self.operations

    @property
    def edges(self) -> tuple[tuple[str, str], ...]:
        """Keys (operand, operation), one for each time that an operation reads a value."""
        return tuple((operand, node.key) for node in self.operations for operand in node.operands)

    def counts(self) -> dict[str, int]:
        """Number of operations by name, the most frequent first."""
        return dict(Counter(node.name for node in self.operations).most_common())

    def shared_with(self, *others: "TorqueGraph") -> tuple[Operation, ...]:
        """Operations that are in each of the others too."""
        for other in others:
            if not isinstance(other, TorqueGraph):
                raise TypeError(
                    f"shared_with takes other graphs, as graph(i, j, k, m) gives them, and got {other!r}"
                )
        keys = [{node.key for node in other.operations} for other in others]
        return tuple(node for node in self.operations if all(node.key in known for known in keys))

    def evaluate(self, q: Any, qd: Any, qdd: Any) -> Tensor:
        """The torque (...) for a motion (..., n), by these operations alone; gradients flow through it.

        Motion is what the calls of the robot take, and refused likewise. Parameters, which are leaves, have
        the values that they have now; all other numbers of the links those of when the graph was made.
        """
        backend, n = self.backend, self.backend.structure.n
        motion = dict(zip(("q", "qd", "qdd"), backend.arrays({"q": q, "qd": qd, "qdd": qdd}, n), strict=True))
        like, values = motion["q"][..., 0], backend._values(motion["q"])
        if not isinstance(self.output, str):
            return torch.full_like(like, self.output)
        columns = {kind: values.unbind(-1) for kind, values in motion.items()}
        named = {f"{kind}[{k}]": column for kind in columns for k, column in enumerate(columns[kind])}
        named |= {f"p[{name}]": value for name, value in values.items()}
        named |= {name: value.to(like) for name, value in learned_entries(backend).items()}
        given = [named[leaf.key] for leaf in self.leaves]
        if all(node.pointwise for node in self.operations):
            result = self.module(*given)
        else:
            wide = [value.expand(like.shape).reshape(-1) for value in given]
            result = torch.func.vmap(self.module)(*wide).reshape(like.shape)
        torque: Tensor = result.to(like.dtype).expand(like.shape)
        return torque

    @cached_property
    def module(self) -> torch.fx.GraphModule:
        """The operations as a module whose arguments are the leaves, in their order."""
        graph, root = torch.fx.Graph(), torch.nn.Module()
        made = {leaf.key: graph.placeholder(f"leaf_{at}") for at, leaf in enumerate(self.leaves)}

        def node(value: Any) -> Any:
            if isinstance(value, Ref):
                return made[value.key]
            if not torch.is_tensor(value):
                return value
            name = f"constant_{len(list(root.buffers()))}"
            root.register_buffer(name, value)
            return graph.get_attr(name)

        for one in self.operations:
            arguments = tuple(mapped(node, one.arguments))
            made[one.key] = graph.call_function(one.call, arguments, dict(one.options))
        graph.output(node(Ref(self.output)) if isinstance(self.output, str) else self.output)
        return torch.fx.GraphModule(root, graph)


def torque_graphs(
    backend: Any,
    links: Callable[[Mapping[str, Tensor]], Iterable[LinkEnergies]],
    joint: int,
    through: Sequence[int],
    parts: Sequence[Part],
) -> tuple[TorqueGraph, ...]:
    """Graphs of parts (k, m) of the torque on a joint through the sum of some links, counted from 0."""
    structure: Structure = backend.structure

    def chosen(values: Mapping[str, Tensor]) -> list[LinkEnergies]:
        every = list(links(values))
        return [every[j] for j in through]

    recorded = record(structure, chosen, leaves_beside_motion(backend), joint, parts)
    names = structure.joint_names
    return tuple(
        TorqueGraph(
            names[joint],
            tuple(structure.link_names[j] for j in through),
            None if k is None else names[k],
            m,
            *_needed(recorded, (k, m)),
            backend,
        )
        for k, m in parts
    )


def _needed(
    recorded: RecordedParts, part: Part
) -> tuple[tuple[Leaf, ...], tuple[Operation, ...], str | float]:
    """Leaves and operations that the value of a part hangs on, and its key, or the number that it is."""
    output = recorded.values[part]
    if not isinstance(output, Ref):
        return (), (), output
    needed = {output.key}
    for key, operation in reversed([*recorded.operations.items()]):
        if key in needed:
            needed.update(operation.operands)
    leaves = tuple(leaf for key, leaf in recorded.leaves.items() if key in needed)
    return leaves, tuple(one for key, one in recorded.operations.items() if key in needed), output.key
