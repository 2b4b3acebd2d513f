"""Torch modules of a robot: holders of its run-time parameters and bodies, and one call to be exported."""

import contextlib
import inspect
from collections.abc import Callable, Collection, ItemsView, Iterable, Iterator, KeysView, Mapping, ValuesView
from operator import attrgetter
from typing import Protocol, cast

import torch
from torch import Tensor

from ..chosen_names import short
from ..interface import Numbers, Unscripted
from ..rule.joint_tree import Bodies
from .backend import ArrayBackend

MOTION = {"q", "qd", "qdd", "tau"}
"""Arguments of shape (..., n)."""


class ReloadableRobot(Protocol):
    """A robot that can be loaded again."""

    backend: ArrayBackend

    @property
    def name(self) -> str:
        """Name of its package."""

    @property
    def n(self) -> int:
        """Number of joints."""

    @property
    def _load(self) -> Callable[..., "ReloadableRobot"]: ...
    @property
    def _asked(self) -> tuple[object, ...]: ...


class RunTimeValues(torch.nn.Module):
    """Run-time parameters by name: links that share a parameter get the same tensor.

    They are buffers, but nn.Parameters where they are given as such or `learned`.
    """

    def __init__(self, values: Mapping[str, object], learned: Collection[str] = ()) -> None:
        super().__init__()
        self._keys = dict(zip(values, attribute_names(values, self), strict=True))
        for name, value in values.items():
            hold(self, self._keys[name], value, name in learned)

    def __getitem__(self, name: str) -> Tensor:
        key = self._keys[name]
        tensor = self._parameters.get(key)
        return cast(Tensor, self._buffers[key]) if tensor is None else tensor

    def __setitem__(self, name: str, value: Tensor) -> None:
        setattr(self, self._keys[name], value)

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)

    def _as_dict(self) -> dict[str, Tensor]:
        return {name: self[name] for name in self._keys}

    def keys(self) -> KeysView[str]:
        """Return the names."""
        return self._keys.keys()

    def values(self) -> ValuesView[Tensor]:
        """Return the tensors."""
        return self._as_dict().values()

    def items(self) -> ItemsView[str, Tensor]:
        """Return the names and tensors."""
        return self._as_dict().items()


class BodyTensors(torch.nn.Module):
    """Tensors of `Bodies`, in the same order."""

    def __init__(self, bodies: Bodies[Numbers]) -> None:
        super().__init__()
        self._names = bodies._fields
        for name, value in bodies._asdict().items():
            hold(self, name, value, False)

    def __iter__(self) -> Iterator[Tensor]:
        return (getattr(self, name) for name in self._names)


class CallModule(Unscripted, torch.nn.Module):
    """Module that answers as one call of a robot does, with a dict by name where that has several results.

    forward accepts the arguments of the call, under the same names, but for those that are `fixed`, and out.
    The module has a robot of its own: its run-time parameters are `values`, and bodies that were given to
    `load` are `bodies`, nn.Parameters where they were given as such, buffers otherwise. A robot that is
    itself a module is shared, as `robot`.
    """

    def __init__(self, robot: ReloadableRobot, call: str, fixed: Mapping[str, object]) -> None:
        """Set up the module.

        Raises ValueError for a call that the robot does not have, and for an argument that the call does not
        have.
        """
        super().__init__()
        self.call, self.fixed = call, dict(fixed)
        self._left = _left_open(robot, call, fixed)
        if not isinstance(robot, torch.nn.Module):
            robot = robot._load(*robot._asked)
            self.values = RunTimeValues(robot.backend.parameters)
            self.bodies = None if robot.backend.bodies is None else BodyTensors(robot.backend.bodies)
        self.robot: ReloadableRobot = robot
        self._lend()

    @property
    def forward(self) -> Callable[..., object]:  # type: ignore[override]
        """The call, with the signature from which exporters read the names of its arguments."""

        def forward(*given: object, **named: object) -> object:
            bound = self._left.bind(*given, **named).arguments
            answer = attrgetter(self.call)(self.robot)(**bound, **self.fixed)
            return answer if torch.is_tensor(answer) else answer._asdict()

        vars(forward)["__signature__"] = self._left
        return forward

    def extra_repr(self) -> str:
        """Return the call and the arguments that are left to give."""
        return f"{self.call}({', '.join(self._left.parameters)})"

    def __setstate__(self, state: dict[str, object]) -> None:
        """Restore what was held by the module of which this is a copy."""
        super().__setstate__(state)  # type: ignore[no-untyped-call]
        self._lend()

    def _lend(self) -> None:
        """Make the robot compute with the tensors held here."""
        if not isinstance(self.robot, torch.nn.Module):
            # They are used as a mapping and a tuple, but modules cannot be subclasses of these.
            self.robot.backend.parameters = cast("Mapping[str, Tensor]", self.values)
            self.robot.backend.bodies = cast("Bodies[Tensor] | None", self.bodies)
        self._make_tables()

    def _make_tables(self) -> None:
        """Call with no samples, so that tables are made.

        torch.compile cannot trace how a first call makes them, and then finds them made.
        """
        needed = [name for name, p in self._left.parameters.items() if p.default is p.empty or name == "tau"]
        if MOTION.issuperset(needed):
            for dtype in (torch.float32, torch.float64):
                with contextlib.suppress(TypeError, ValueError):  # which a call of the user's will raise
                    self.forward(*(torch.zeros(0, self.robot.n, dtype=dtype) for _ in needed))


def hold(module: torch.nn.Module, key: str, value: object, learned: bool) -> None:
    """Register a number of the robot in a module: a tensor as it is, anything else as a tensor of float64."""
    tensor = value if torch.is_tensor(value) else torch.as_tensor(value, dtype=torch.float64)
    if learned and not isinstance(tensor, torch.nn.Parameter):
        real = tensor if tensor.is_floating_point() else tensor.double()
        tensor = torch.nn.Parameter(real.detach().clone())
    if isinstance(tensor, torch.nn.Parameter):
        module.register_parameter(key, tensor)
    else:
        module.register_buffer(key, tensor)


def attribute_names(names: Iterable[str], module: torch.nn.Module) -> list[str]:
    """Return names as keys of a state_dict: without dots, and none that the module has already."""
    found: list[str] = []
    for name in names:
        key = name.replace(".", "_") or "_"
        while hasattr(module, key) or key in found:
            key += "_"
        found.append(key)
    return found


def _left_open(robot: ReloadableRobot, call: str, fixed: Mapping[str, object]) -> inspect.Signature:
    """Return the signature of a call without what is fixed, and without out.

    Raises ValueError for a call that the robot does not have, and for an argument that the call does not
    have.
    """
    taken: Mapping[str, inspect.Parameter] = {}
    with contextlib.suppress(AttributeError, TypeError):
        taken = inspect.signature(attrgetter(call)(robot)).parameters
    if next(iter(taken), None) != "q":
        raise ValueError(
            f"{short(call)} is no call of {robot.name} that is given positions q; name one, such as "
            "partial_torque or kinematics.jacobian"
        )
    open_to = [name for name in taken if name != "out"]
    for name in fixed:
        if name not in open_to:
            raise ValueError(f"{call} takes no {short(name)}; it takes {', '.join(open_to)}")
    return inspect.Signature([taken[name] for name in open_to if name not in fixed])
