"""Torch's own graph behind a tensor: what it recorded, node by node, as a walk along `grad_fn` meets it."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from torch import Tensor


@dataclass(frozen=True)
class RecordedNode:
    """A node of torch's graph: an operation that it would go back through, or a tensor that it ends at."""

    name: str
    """Torch's name, such as MulBackward0; of a tensor AccumulateGrad."""
    operands: tuple[int, ...]
    """Indices of the nodes before it; values that need no gradient have none."""
    leaf: str = ""
    """Name of the tensor at a leaf, such as q; empty at operations."""


@dataclass(frozen=True, repr=False)
class RecordedGraph:
    """Torch's graph behind a value; each node comes after those before it, the value's own is the last."""

    title: str
    """Call and entry that it is behind."""
    nodes: tuple[RecordedNode, ...]

    def __len__(self) -> int:
        return len(self.nodes)

    def __repr__(self) -> str:
        return f"<RecordedGraph: {self.title}: {len(self)} nodes>"

    def counts(self) -> dict[str, int]:
        """Return the number of nodes by torch's names, the most frequent first."""
        return dict(Counter(node.name for node in self.nodes).most_common())


def recorded_graph(title: str, value: Tensor, leaves: Mapping[str, Tensor]) -> RecordedGraph:
    """Return the graph behind a value.

    leaves: tensors that it may end at, by name; others are called after their shape
    """
    known = {id(tensor): name for name, tensor in leaves.items()}
    found, numbers = list[RecordedNode](), dict[Any, int]()
    waiting = [value.grad_fn] if value.grad_fn is not None else []
    while waiting:
        node: Any = waiting[-1]
        before = [one for one, _ in node.next_functions if one is not None]
        if later := [one for one in before if one not in numbers]:
            waiting += later
            continue
        waiting.pop()
        if node in numbers:
            continue
        tensor = getattr(node, "variable", None)
        leaf = "" if tensor is None else known.get(id(tensor), f"tensor of shape {tuple(tensor.shape)}")
        numbers[node] = len(found)
        found.append(RecordedNode(node.name(), tuple(numbers[one] for one in before), leaf))
    return RecordedGraph(title, tuple(found))
