"""A model joined of a robot's model and the models of its payloads, which follow the links."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics

from linkwise.analysis.model_side import NAMES, Side
from linkwise.package.load import Array


@dataclass(frozen=True)
class _Part:
    """A payload's model, its link there, its number among all links, and the places of its packed values."""

    model: Dynamics
    link: int
    number: int
    columns: Side


@dataclass(frozen=True)
class PayloadModel:
    """A model of the links and the payloads together, with the calls that an analysis makes."""

    own: Dynamics
    parts: tuple[_Part, ...]
    layout: Side

    @classmethod
    def of(cls, own: Dynamics, payloads: Sequence[tuple[int, Dynamics]]) -> "PayloadModel":
        """Join a robot's model and those of its payloads.

        payloads: for each, the link that carries it, and the package with that payload alone
        """
        parts = []
        for number, (link, model) in enumerate(payloads, len(own.link_names)):
            columns = Side(*(np.flatnonzero(getattr(model.layout, name)[:, 1] == link) for name in NAMES))
            parts.append(_Part(model, link, number, columns))
        layouts = []
        for name in NAMES:
            rows = [np.asarray(getattr(own.layout, name))]
            for part in parts:
                there = np.array(getattr(part.model.layout, name)[getattr(part.columns, name)])
                there[:, 1] = part.number
                rows.append(there)
            layouts.append(np.concatenate(rows))
        return cls(own, tuple(parts), Side(*layouts))

    def __getattr__(self, name: str) -> Any:
        """Return what payloads do not change: names, kinematics, passive torques of the joints."""
        return getattr(self.own, name)

    @property
    def open(self) -> "PayloadModel":
        """This model without ties, where joints are tied."""
        own: Any = self.own
        payloads: Any = [(part.link, part.model) for part in self.parts]
        return PayloadModel.of(own.open, [(link, model.open) for link, model in payloads])

    def packed(self, q: Array, qd: Array, qdd: Array) -> Side:
        """Return all coefficients and τ_ij on the paths, packed in the order of `layout`."""
        values = [self.own.packed(q, qd, qdd), *(part.model.packed(q, qd, qdd) for part in self.parts)]
        joined = []
        for name in NAMES:
            some = [getattr(values[0], name)]
            for part, value in zip(self.parts, values[1:], strict=True):
                some.append(getattr(value, name)[..., getattr(part.columns, name)])
            joined.append(np.concatenate(some, axis=-1))
        return Side(*joined)

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return τ_i of links and payloads, (S, n)."""
        models = [self.own, *(part.model for part in self.parts)]
        torque: Array = np.sum([model.inverse_dynamics(q, qd, qdd) for model in models], axis=0)
        return torque

    def propagation(self, q: Array, qd: Array, qdd: Array, convention: Any = "closing") -> Side:
        """Return τp_ij(q̈_k) and τp_ij(q̇_k), (S, n, N, n) each, and g_ij, (S, n, N)."""
        joined = list(self.own.propagation(q, qd, qdd, convention=convention))
        for part in self.parts:
            found = part.model.propagation(q, qd, qdd, convention=convention)
            joined = [
                np.concatenate([a, b[:, :, part.link, None]], axis=2)
                for a, b in zip(joined, found, strict=True)
            ]
        acceleration, velocity, gravity = joined
        return Side(acceleration, velocity, gravity, torque=None)

    def forces(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the constraint forces due to links and payloads, (S, C, N), where there are constraints."""
        own: Any = self.own
        parts: Any = [part.model for part in self.parts]
        there = [
            model.forces(q, qd, qdd)[..., [part.link]] for model, part in zip(parts, self.parts, strict=True)
        ]
        return np.concatenate([own.forces(q, qd, qdd), *there], axis=-1)
