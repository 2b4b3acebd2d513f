"""Answers to `Dynamics.graph` and `Dynamics.graph_parts`: autograd's graphs, to count and to run."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from typing import Any, NoReturn, Protocol, cast

import torch
from torch import Tensor
from torch.fx.node import Argument

from ..arrays.torch_modules import RunTimeValues
from ..chosen_names import whole_number
from ..interface import Numbers
from ..structure import Structure
from .energy_interface import Energies, Nested, Number, Parameters
from .operation_recorder import Leaf, Operation, Ref, mapped
from .recorded_graph import RecordedGraph, recorded_graph
from .recorded_torques import LinkEnergies, Part, RecordedParts, WrittenEnergies, record
from .written_sweeps import WrittenTerms

Name = int | str
Links = Name | Iterable[Name] | None
ORDERS = "2 for acceleration, 1 for velocity, 0 for position and gravity"


class GraphSource(Protocol):
    """A back end as graphs need it: it checks the motion, and has the energies and the parameters' values."""

    structure: Structure
    given: RunTimeValues

    @property
    def modules(self) -> Iterable[Energies]:
        """Modules of the links, together one module."""

    def arrays(self, named: Mapping[str, object], n: int) -> Sequence[Numbers]:
        """Return the motion, checked and broadcast to a common shape (..., n)."""

    def _values(self, q: Tensor) -> Mapping[str, Tensor]: ...


@dataclass(frozen=True, eq=False, repr=False)
class TorqueGraph:
    """Torch operations, and the motions and parameters that they start from, up to a torque in N m or N.

    Keys of leaves and operations are the same in every graph, so that graphs can be compared node by node.
    """

    joint: str
    """Joint i that is loaded."""
    links: tuple[str, ...]
    """Links j through which it is loaded: one, or all."""
    coordinate: str | None
    """Joint k whose motion the part is due to; None for all."""
    order: int | None
    """2 acceleration, 1 velocity; 0 position, without a coordinate gravity or named shares; None for all."""
    leaves: tuple[Leaf, ...]
    """Motions and parameters that are connected with the torque."""
    operations: tuple[Operation, ...]
    """Operations, each after its operands."""
    output: str | float
    """Key of the torque; a number where the torque is constant, usually 0.0."""
    backend: GraphSource
    """Back end that checks the motion and has the parameters' values."""

    def __repr__(self) -> str:
        """Return which torque or part of it this is, and its size; the operations are in `operations`."""
        words = {None: "motion", 0: "position", 1: "velocity", 2: "acceleration"}
        still = "named shares" if self.backend.structure.shares else "gravity"
        every = {None: "", 0: f", {still}", 1: ", all velocities", 2: ", all accelerations"}
        part = every[self.order] if self.coordinate is None else f", {words[self.order]} of {self.coordinate}"
        through = ", ".join(self.links) if len(self.links) <= 3 else f"{len(self.links)} links"
        sizes = f"{len(self.operations)} operations, {len(self.leaves)} leaves"
        return f"<TorqueGraph: torque on {self.joint} through {through}{part}: {sizes}>"

    def __copy__(self) -> "TorqueGraph":
        """Return the graph itself: nothing of it can be changed."""
        return self

    def __reduce_ex__(self, protocol: object) -> NoReturn:
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
        """Keys (operand, operation), one pair for each time that an operation reads a value."""
        return tuple((operand, node.key) for node in self.operations for operand in node.operands)

    def counts(self) -> dict[str, int]:
        """Return the number of operations by name, the most frequent first."""
        return dict(Counter(node.name for node in self.operations).most_common())

    def shared_with(self, *others: "TorqueGraph") -> tuple[Operation, ...]:
        """Return the operations that are in each of the other graphs too."""
        for other in others:
            if not isinstance(other, TorqueGraph):
                raise TypeError(
                    f"shared_with takes other graphs, as graph(i, j, k, m) gives them, and got {other!r}"
                )
        keys = [{node.key for node in other.operations} for other in others]
        return tuple(node for node in self.operations if all(node.key in known for known in keys))

    def evaluate(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return the torque (...) for a motion (..., n), by these operations alone.

        Gradients pass through them. The motion is checked as in the calls of the robot. Parameters, which
        are leaves, have the values that they have now; all other numbers of the links those of when the
        graph was made.
        """
        backend, n = self.backend, self.backend.structure.n
        read = cast("Sequence[Tensor]", backend.arrays({"q": q, "qd": qd, "qdd": qdd}, n))
        motion = dict(zip(("q", "qd", "qdd"), read, strict=True))
        like, values = motion["q"][..., 0], backend._values(motion["q"])
        if not isinstance(self.output, str):
            return torch.full_like(like, self.output)
        columns = {kind: values.unbind(-1) for kind, values in motion.items()}
        named = {f"{kind}[{k}]": column for kind in columns for k, column in enumerate(columns[kind])}
        named |= {f"p[{name}]": value for name, value in values.items()}
        named |= {name: value.to(like) for name, value in _learned_entries(backend).items()}
        given = [named[leaf.key] for leaf in self.leaves]
        if all(node.pointwise for node in self.operations):
            result = self.module(*given)
        else:
            wide = [value.expand(like.shape).reshape(-1) for value in given]
            result = torch.func.vmap(self.module)(*wide).reshape(like.shape)
        torque: Tensor = result.to(like.dtype).expand(like.shape)
        return torque

    def recorded(self, q: Tensor, qd: Tensor, qdd: Tensor) -> RecordedGraph:
        """Return torch's own graph behind this torque as `partial_torque` has it at a motion (..., n).

        It has every node that torch recorded, where this graph has equal operations once and no constants,
        vectors and views: a walk along `grad_fn` meets as many. Leaves are q, qd, qdd, and what is learned.
        Raises ValueError for a part of a torque, which no call of torch answers.
        """
        if self.coordinate is not None or self.order is not None:
            raise ValueError(
                "torch records calls, and none answers a part of a torque alone; ask graph(i, j) for recorded"
            )
        backend: Any = self.backend
        structure = backend.structure
        given = {"q": q, "qd": qd, "qdd": qdd}
        leaves = {
            name: torch.as_tensor(value).detach().clone().requires_grad_() for name, value in given.items()
        }
        read = cast("Sequence[Tensor]", backend.arrays(leaves, structure.n))
        (tau,) = backend.answers.partial_torque(*read)
        joint = structure.joint_names.index(self.joint)
        through = [structure.link_names.index(link) for link in self.links]
        value = tau[..., joint, through[0]] if len(through) == 1 else tau[..., joint, through].sum(-1)
        learned = dict(cast(torch.nn.Module, backend.modules).named_parameters())
        entry = f"partial_torque(q, qd, qdd) on {self.joint} through {', '.join(self.links)}"
        return recorded_graph(entry, value, leaves | learned | dict(backend.parameters))

    @cached_property
    def module(self) -> torch.fx.GraphModule:
        """The operations as a module whose arguments are the leaves, in their order."""
        graph, root = torch.fx.Graph(), torch.nn.Module()
        made = {leaf.key: graph.placeholder(f"leaf_{at}") for at, leaf in enumerate(self.leaves)}

        def node(value: object) -> Argument:
            if isinstance(value, Ref):
                return made[value.key]
            if not torch.is_tensor(value):
                return cast("Argument", value)
            name = f"constant_{len(list(root.buffers()))}"
            root.register_buffer(name, value)
            return graph.get_attr(name)

        for one in self.operations:
            arguments = cast("tuple[Argument, ...]", tuple(mapped(node, one.arguments)))
            options = cast("dict[str, Argument]", dict(one.options))
            made[one.key] = graph.call_function(one.call, arguments, options)
        graph.output(node(Ref(self.output)) if isinstance(self.output, str) else self.output)
        return torch.fx.GraphModule(root, graph)


def graph_of(backend: GraphSource, i: Name, j: Links, k: Name | None, m: int | None) -> TorqueGraph:
    """Return the graph of a torque, see `Dynamics.graph`."""
    joint, through = _place(backend, i, j)
    order = None if m is None else whole_number(m)
    if order not in (0, 1, 2) and m is not None:
        raise ValueError(f"m is {m!r}; choose {ORDERS}, or leave it away for all of them")
    coordinate = None if k is None else backend.structure.joint_index(k, "k")
    return _torque_graphs(backend, joint, through, [(coordinate, order)])[0]


def graph_parts_of(backend: GraphSource, i: Name, j: Links) -> tuple[TorqueGraph, ...]:
    """Return the graphs of a torque's parts, see `Dynamics.graph_parts`."""
    joint, through = _place(backend, i, j)
    paths = [path for at in through if joint in (path := backend.structure.paths[at])]
    coordinates = sorted({k for path in paths for k in path})
    parts: list[Part] = [(k, m) for m in (2, 1) for k in coordinates]
    found = _torque_graphs(backend, joint, through, [*parts, (None, 0)])
    return tuple(one for one in found if one.output != 0.0)


def _place(backend: GraphSource, i: Name, j: Links) -> tuple[int, tuple[int, ...]]:
    structure = backend.structure
    joint = structure.joint_index(i, "i")
    if j is None:
        return joint, tuple(range(structure.N))
    single = isinstance(j, str) or whole_number(j) is not None
    chosen = cast(Iterable[Name], (j,) if single else j)
    through = tuple(structure.link_index(link, "j") for link in chosen)
    for at, link in enumerate(through):
        if link in through[:at]:
            raise ValueError(f"j names link {structure.link_names[link]} twice; give each link once")
    return joint, through


def _torque_graphs(
    backend: GraphSource, joint: int, through: Sequence[int], parts: Sequence[Part]
) -> tuple[TorqueGraph, ...]:
    """Return graphs of parts (k, m) of the torque on a joint through the sum of some links; all from 0."""
    structure, links = backend.structure, list(backend.modules)

    def chosen(values: Mapping[str, Tensor]) -> list[LinkEnergies]:
        p = _seen_as_leaves(backend, values)
        return [
            LinkEnergies(
                link.path,
                partial(link.kinetic, p=p),
                partial(link.potential, p=p),
                _written(link, p) if structure.shares else None,
            )
            for link in (links[j] for j in through)
        ]

    recorded = record(structure, chosen, _leaves_beside_motion(backend), joint, parts)
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


def _written(module: Energies, p: Parameters) -> WrittenEnergies:
    """Return the sums over the shares of a link that was written by hand."""
    link = cast(WrittenTerms, module)

    def motion(q: Sequence[Tensor], qd: Sequence[Tensor]) -> Number:
        return sum(link.motions(q, qd, p).values(), 0.0)

    def dissipation(q: Sequence[Tensor], qd: Sequence[Tensor]) -> Number:
        return sum(link.dissipations(q, qd, p).values(), 0.0)

    def force(q: Sequence[Tensor], qd: Sequence[Tensor], joint: int) -> Number:
        found = (by_joint[joint] for by_joint in link.forces(q, qd, p).values() if joint in by_joint)
        return sum(found, 0.0)

    return WrittenEnergies(link.degree, motion, dissipation, force, p[link.time] if link.time else None)


def _needed(
    recorded: RecordedParts, part: Part
) -> tuple[tuple[Leaf, ...], tuple[Operation, ...], str | float]:
    """Return the leaves and operations that a part's value depends on, and its key, or a constant value."""
    output = recorded.values[part]
    if not isinstance(output, Ref):
        return (), (), output
    needed = {output.key}
    for key, operation in reversed([*recorded.operations.items()]):
        if key in needed:
            needed.update(operation.operands)
    leaves = tuple(leaf for key, leaf in recorded.leaves.items() if key in needed)
    return leaves, tuple(one for key, one in recorded.operations.items() if key in needed), output.key


def _leaves_beside_motion(backend: GraphSource) -> dict[Leaf, Tensor]:
    """Return the leaves, other than the motion, that a graph may have, with their present values."""
    given = {Leaf(f"p[{name}]", "parameter", name): value for name, value in backend.given.items()}
    return given | {Leaf(name, "parameter", name): entry for name, entry in _learned_entries(backend).items()}


def _learned_entries(backend: GraphSource) -> dict[str, Tensor]:
    """Return the present numbers of links that are nn.Parameters, by names such as links.link2.com[0]."""
    return {
        name: entry
        for link, module in _modules(backend)
        for key, tensor in module._parameters.items()
        if tensor is not None
        for name, entry in zip(_names(link, key, tensor), tensor.reshape(-1).unbind(), strict=True)
    }


def _seen_as_leaves(backend: GraphSource, values: Mapping[str, Tensor]) -> Parameters:
    """Return the parameters for recording energies: leaves by key, and numbers where nothing is learned."""
    learned = {
        module: {
            key: _nested(iter([values[name] for name in _names(link, key, tensor)]), tensor.shape)
            for key, tensor in module._parameters.items()
            if tensor is not None
        }
        for link, module in _modules(backend)
    }
    run_time = {name: values[f"p[{name}]"] for name in backend.given}
    return Parameters(run_time, torch.zeros((), dtype=torch.float64), wanted=False, learned=learned)


def _modules(backend: GraphSource) -> Iterator[tuple[str, torch.nn.Module]]:
    return cast(torch.nn.Module, backend.modules).named_children()


def _names(link: str, key: str, tensor: Tensor) -> list[str]:
    """Return a name for each entry: the tensor's in the robot's state_dict, and the entry's place in it."""
    places = product(*map(range, tensor.shape))
    return [f"links.{link}.{key}{list(place) if place else ''}" for place in places]


def _nested(entries: Iterator[Tensor], shape: tuple[int, ...]) -> Nested:
    """Return entries in lists of lists, as `Tensor.tolist` nests numbers."""
    return [_nested(entries, shape[1:]) for _ in range(shape[0])] if shape else next(entries)
