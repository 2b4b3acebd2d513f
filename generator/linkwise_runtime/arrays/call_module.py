"""One call of a robot as a torch module: to be exported, compiled, or put among others."""

import contextlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from operator import attrgetter
from typing import Any

import torch
from torch import Tensor

from ..chosen_names import short
from .run_time_values import RunTimeValues, hold

MOTION = {"q", "qd", "qdd", "tau"}
"""Arguments of shape (..., n)."""


class CallModule(torch.nn.Module):
    """module(q, ...) answers as the call does; where that has several results, with a dict of them by name.

    forward takes what the call takes, under the same names, but for what is `fixed`, and out. The robot is
    one of its own: its run-time parameters are `values`, and bodies that were given to `load` are `bodies`,
    nn.Parameters where they were given as such, buffers otherwise. A robot that is itself a module is shared,
    as `robot`.
    """

    def __init__(self, robot: Any, call: str, fixed: Mapping[str, Any]) -> None:
        """Raises ValueError for a call that the robot does not have, and for what the call does not take."""
        super().__init__()
        self.call, self.fixed = call, dict(fixed)
        self._left = _left_open(robot, call, fixed)
        if not isinstance(robot, torch.nn.Module):
            robot = robot._load(*robot._asked)
            self.values = RunTimeValues(robot.backend.parameters)
            self.bodies = None if robot.backend.bodies is None else BodyTensors(robot.backend.bodies)
        self.robot = robot
        self._lend()

    @property
    def forward(self) -> Callable[..., Any]:  # type: ignore[override]
        """The call, with the signature in which exporters look for the names of what it takes."""

        def forward(*given: Any, **named: Any) -> Any:
            bound = self._left.bind(*given, **named).arguments
            answer = attrgetter(self.call)(self.robot)(**bound, **self.fixed)
            return answer if torch.is_tensor(answer) else answer._asdict()

        vars(forward)["__signature__"] = self._left
        return forward

    def extra_repr(self) -> str:
        """The call and what is left to give."""
        return f"{self.call}({', '.join(self._left.parameters)})"

    def __setstate__(self, state: Any) -> None:
        """Take over what the module held of which this is a copy."""
        super().__setstate__(state)  # type: ignore[no-untyped-call]
        self._lend()

    def _lend(self) -> None:
        """Have the robot compute with the tensors held here."""
        if not isinstance(self.robot, torch.nn.Module):
            self.robot.backend.parameters = self.values
            self.robot.backend.bodies = self.bodies
        self._make_tables()

    def _make_tables(self) -> None:
        """Call with no samples: torch.compile cannot trace what a first call makes, and finds it made."""
        needed = [name for name, p in self._left.parameters.items() if p.default is p.empty or name == "tau"]
        if MOTION.issuperset(needed):
            for dtype in (torch.float32, torch.float64):
                with contextlib.suppress(TypeError, ValueError):  # which a call of the user's will raise
                    self.forward(*(torch.zeros(0, self.robot.n, dtype=dtype) for _ in needed))


class BodyTensors(torch.nn.Module):
    """The tensors of `Bodies`, in the same order."""

    def __init__(self, bodies: Any) -> None:
        super().__init__()
        self._names = bodies._fields
        for name, value in bodies._asdict().items():
            hold(self, name, value, False)

    def __iter__(self) -> Iterator[Tensor]:
        return (getattr(self, name) for name in self._names)


def _left_open(robot: Any, call: str, fixed: Mapping[str, Any]) -> inspect.Signature:
    """Signature of a call without what is fixed, and without out."""
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
