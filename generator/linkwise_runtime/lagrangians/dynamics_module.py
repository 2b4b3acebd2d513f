"""A robot whose links are torch modules, and which is a torch module itself."""

import copy
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Self, cast

import torch
from torch import Tensor

from ..arrays.backend import ArrayBackend
from ..arrays.torch_modules import RunTimeValues, attribute_names
from ..chosen_names import choice, position_of, short
from ..door import Door
from ..dynamics import Dynamics
from ..rule.calls import RigidRule
from ..structure import Structure
from .autograd_backend import AutogradBackend
from .partial_lagrangian import PartialLagrangian, RigidLagrangian
from .replaced_link import replaced

MADE_ANEW = ("structure", "backend", "layout", "_load", "_asked", "door", "kinematics", "constraints")
"""Attributes that a copy does not take over: it has its own."""

KINDS = ("mass", "com", "inertia", "place")
"""Constants of rigid links."""


class LinkModules(torch.nn.Module):
    """The links' modules: links[j] with j from 0, or links["name"].

    In a state_dict they have their names, without dots.
    """

    def __init__(self, names: Iterable[str], modules: Iterable[PartialLagrangian]) -> None:
        super().__init__()
        self.names = tuple(names)
        self._keys = attribute_names(self.names, self)
        for key, module in zip(self._keys, modules, strict=True):
            self.add_module(key, module)

    def __getitem__(self, link: int | str) -> PartialLagrangian:
        """Return a link's module; -1 is the last link. Raises ValueError for a link that is not there."""
        if isinstance(link, int) and -len(self.names) <= link < 0:
            link += len(self.names)
        link = position_of(link, self.names, "link", "the link")
        return cast(PartialLagrangian, self._modules[self._keys[link]])

    def __setitem__(self, link: int | str, module: torch.nn.Module) -> None:
        """Have a module's energies count for a link; its torques and shares follow.

        The module has kinetic(q, qd, p) and potential(q, p), tensors of the shape of q[k] in J, of the
        coordinates of the link's path alone; kinetic energy is of degree two in the velocities, and calls
        that coefficients answer refuse another, which training may have made. Other links are moved by the
        package's own numbers. The module is then links[j].module, and the package's own, which was links[j],
        undoes this. Raises ValueError for a link that is not there, TypeError for another module.
        """
        own = self[link]
        at = next(j for j in range(len(self)) if self[j] is own)
        self.add_module(self._keys[at], replaced(own, module))

    def __setattr__(self, name: str, value: Any) -> None:
        """Have links.link2 = module mean links["link2"] = module."""
        keys = vars(self).get("_keys", ())
        if name in keys:
            self[keys.index(name)] = value
        else:
            super().__setattr__(name, value)

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[PartialLagrangian]:
        return (self[j] for j in range(len(self)))

    def with_values(self, given: RunTimeValues) -> "LinkModules":
        """Return these modules, with the tensors that they hold, for other run-time parameters."""
        made = {id(link): copy.copy(link) for link in self}
        for link in made.values():
            link._before = (made.get(id(link.before), link.before),)
            link._backend = AutogradBackend(link._backend.structure, (link,), given)
        return LinkModules(self.names, made.values())


def links_and_values(
    structure: Structure,
    kinds: Sequence[type[PartialLagrangian]],
    values: Mapping[str, object],
    requires_grad: bool | str | Iterable[str],
) -> tuple[LinkModules, RunTimeValues]:
    """Return one module for each link, and the run-time parameters, which the modules share.

    requires_grad: as in the package's `load`
    """
    rigid = any(issubclass(kind, RigidLagrangian) for kind in kinds)
    learned = learned_names(requires_grad, values, rigid)
    given, made = RunTimeValues(values, learned), dict[type[PartialLagrangian] | None, PartialLagrangian]()
    for j, kind in enumerate(kinds):
        made[kind] = kind(structure.only(j), given, made.get(kind.parent), learned)
    if not isinstance(requires_grad, bool):
        _refuse_idle(learned.intersection(KINDS), made.values(), values)
    return LinkModules(structure.link_names, made.values()), given


def learned_names(asked: bool | str | Iterable[str], parameters: Iterable[str], rigid: bool) -> set[str]:
    """Return the names of constants and run-time parameters that become nn.Parameters.

    Raises ValueError for a name that is none of them, and TypeError for anything but names or a bool.
    """
    known = [*(KINDS if rigid else ()), *parameters]
    if isinstance(asked, bool):
        return set(known) if asked else set()
    if not isinstance(asked, Iterable):
        raise TypeError(f"requires_grad is {short(asked)}; give True, or names: {', '.join(known)}")
    names = {asked} if isinstance(asked, str) else set(asked)
    for name in sorted(names.difference(known), key=str):
        there = f"choose among {', '.join(known)}" if known else "this package has no number to learn"
        raise ValueError(f"requires_grad names {name!r}; {there}")
    return names


def _refuse_idle(
    kinds: Iterable[str], modules: Collection[PartialLagrangian], parameters: Mapping[str, object]
) -> None:
    """Raise ValueError for a kind of constants that no link has, as they depend on run-time parameters."""
    for kind in sorted(kinds):
        if not any(kind in module._parameters for module in modules):
            raise ValueError(
                f"requires_grad names {kind!r}, which hangs on run-time parameters in every link here; name "
                f"these: {choice(kind, parameters, 'parameters')}"
            )


class DynamicsModule(Dynamics, torch.nn.Module):
    """`Dynamics` as an nn.Module: robot(q, qd, qdd) is `partial_torque`, links[j] is the module of link j.

    A state_dict holds the numbers of each link as links.NAME.mass and so on, and run-time parameters as
    values.NAME. Changes to these, also by `load_state_dict`, take effect at the next call. Calls compute in
    the motion's dtype and on its device, wherever the modules are. Hooks run for robot(q, qd, qdd) and
    links[j](q, qd), but not for the calls that have names.
    """

    links: LinkModules
    """Modules of the links, by number or by name."""
    values: RunTimeValues
    """Run-time parameters, which links share."""

    def __init__(
        self,
        structure: Structure,
        backend: ArrayBackend,
        load: Callable[..., Dynamics],
        asked: tuple[Any, ...],
        check_finite: bool = False,
    ) -> None:
        torch.nn.Module.__init__(self)
        own: Any = backend
        self.links, self.values = own.modules, own.given
        Dynamics.__init__(self, structure, backend, load, asked, check_finite)

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse other links as a whole: calls would not see them."""
        if name == "links" and name in self._modules:
            raise AttributeError("links are replaced one by one: robot.links[j] = module")
        super().__setattr__(name, value)

    def at(self, **values: Any) -> Self:
        """Return the robot with other values, as `Dynamics.at` says, and with this robot's modules.

        Both have the same tensors, but for the values given, so that gradients and training reach this one.
        """
        robot = super().at(**values)
        keys = self.values.keys()
        given = RunTimeValues({name: (robot if name in values else self).values[name] for name in keys})
        robot._take(self.links.with_values(given), given)
        return robot

    def forward(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return tau_ij, shape (..., n, N)."""
        return self.partial_torque(q, qd, qdd)

    @property
    def parameters(self) -> Any:
        """Run-time parameters by name; when called, as for every nn.Module, the tensors to be learned."""
        return _Parameters(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """Describe how a pickle or a copy is made: the robot is loaded again, with this one's modules."""
        name, _, *asked = self._asked
        state = {key: value for key, value in vars(self).items() if key not in MADE_ANEW}
        return self._load, (name, None, *asked), (state, self.check_finite)

    def __setstate__(self, state: Any) -> None:
        """Take over the modules of the robot that this one is a copy of, and whatever else was set there."""
        kept, check_finite = state
        vars(self).update(kept)
        self._take(self.links, self.values)
        self.check_finite = check_finite

    def _take(self, links: LinkModules, values: RunTimeValues) -> None:
        """Compute with these modules and run-time parameters."""
        self._modules |= {"links": links, "values": values}
        kind: Any = type(self.backend)
        self.backend = kind(self.structure, links, values, self.backend.tree)
        self.door = Door(self.structure, self.backend, self.check_finite)


class BackendOfLinks(AutogradBackend):
    """The back end of a robot whose links are such modules."""

    face: ClassVar[Any] = DynamicsModule


def backend_of_links(
    structure: Structure,
    kinds: Sequence[type[PartialLagrangian]],
    values: Mapping[str, Any],
    requires_grad: bool | str | Iterable[str] = False,
    rule: RigidRule | None = None,
) -> BackendOfLinks:
    """Return the back end of one module for each link; `requires_grad` means what it does in `load`.

    rule: rule of the package's tree, which frames need; None for links that are given by their energies
    """
    modules, given = links_and_values(structure, kinds, values, requires_grad)
    return BackendOfLinks(structure, modules, given, rule.tree if rule else None)


class _Parameters(Mapping[str, Tensor]):
    """The attribute `parameters`: a mapping as in Dynamics, and a call as in nn.Module."""

    def __init__(self, robot: DynamicsModule) -> None:
        self._robot = robot

    def __call__(self, recurse: bool = True) -> Iterator[torch.nn.Parameter]:
        return torch.nn.Module.parameters(self._robot, recurse)

    def __getitem__(self, name: str) -> Tensor:
        value: Tensor = self._robot.values[name]
        return value

    def __iter__(self) -> Iterator[str]:
        return iter(self._robot.values.keys())

    def __len__(self) -> int:
        return len(self._robot.values.keys())

    def __repr__(self) -> str:
        return repr(dict(self))
