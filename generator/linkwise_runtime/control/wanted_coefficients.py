"""What is wanted in place of natural coefficients: how much of them is kept, and what is added.

    M*_ik = sum_j w_ijk c2_ijk + m_ik        B*_ik = sum_j w_ijk c1_ijk + b_ik

Entries that are given in place of the natural ones have w = 0 and their value in m or b, a scale alpha_ij
has w_ijk = alpha_ij, and a sum that is given whole has w = 0 everywhere.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import has_tensors
from ..chosen_names import short
from ..controllers import Natural
from ..structure import Structure
from .gains import Gain, numbers_of


class WantedShares(NamedTuple):
    """Targets for the coefficients of one order."""

    kept: Any
    """w: a number for all, or (n, N, 1) or (n, N, n), tensors among them."""
    by_link: NDArray[Any] | None
    """w of each link, (N,), where it is the same for all joints that it is felt by; else None."""
    added: Gain | None
    whole: bool
    """Whether `added` was given as the sum over the links, armature included."""
    positive: bool
    """Whether what is added is known to be positive."""

    @property
    def natural(self) -> bool:
        """Whether all is as it is."""
        return self.added is None and isinstance(self.kept, float) and self.kept == 1.0

    def of(self, side: Any, natural: Any, by_link: Any, like: Any) -> Any:
        """The wanted sum (..., n, n): `natural` is the sum of the natural ones, `by_link` (..., n, N, n)."""
        if isinstance(self.kept, float):
            kept = natural if self.kept == 1.0 else self.kept * natural
        else:
            kept = (side.weights("scale", self.kept, like) * by_link).sum(-2)
        return kept if self.added is None else kept + self.added.matrix(side, like)


def wanted(name: str, given: Any, structure: Structure, definite: bool) -> WantedShares:
    """Targets as `Dynamics.partial_impedance` takes them; raises ValueError and TypeError as it says.

    definite: whether a sum that is given must be positive definite and symmetric, as inertia must
    """
    names = structure.joint_names
    if isinstance(given, Natural):
        plus = f"{name}.plus"
        added = None if given.plus is None else Gain(plus, given.plus, names, symmetric=definite)
        return WantedShares(*_scaled(f"{name}.scale", given.scale, structure), added, False, True)
    if isinstance(given, Mapping):
        kept, values = entries_apart(name, given, structure)
        return WantedShares(kept, None, Gain(name, values, names, any_sign=True), False, False)
    added = Gain(name, given, names, structure.N, definite, symmetric=definite)
    check_paths(name, given, structure)
    whole = np.ndim(given.detach() if has_tensors([given]) else given) < 3
    return WantedShares(0.0, np.zeros(structure.N), added, whole, True)


def stiffness_of(given: Any, structure: Structure) -> Gain | None:
    """K*, None for none; raises ValueError for what is not symmetric or not positive."""
    if isinstance(given, Mapping):
        given = entries_apart("stiffness", given, structure)[1]
    elif isinstance(given, Natural):
        raise TypeError(
            "stiffness is Natural, but a position loads nothing by itself, and gravity, as any potential, is "
            "compensated; give numbers in N m/rad or N/m"
        )
    gain = Gain("stiffness", given, structure.joint_names, structure.N)
    check_paths("stiffness", given, structure)
    return gain if has_tensors([given]) or gain.numbers.any() else None


def check_paths(name: str, given: Any, structure: Structure) -> None:
    """Raise ValueError for an entry (n, N, n) of a joint that does not move the link."""
    if np.ndim(given.detach() if has_tensors([given]) else given) != 3:
        return
    numbers = np.asarray(given.detach().cpu() if has_tensors([given]) else given, float)
    for place in np.argwhere(numbers):
        entry_of(name, tuple(place.tolist()), structure)


def entries_apart(
    name: str, given: Mapping[Any, Any], structure: Structure
) -> tuple[NDArray[Any], NDArray[Any]]:
    """w (n, N, n), zero for the entries, and their values summed over the links."""
    kept = np.ones((structure.n, structure.N, structure.n))
    values = np.zeros((structure.n, structure.n))
    for key, value in given.items():
        if not isinstance(key, tuple) or len(key) != 3:
            raise ValueError(f"{name} has the key {short(key)}; entries are (joint, link, coordinate)")
        i, j, k = entry_of(name, key, structure)
        if not kept[i, j, k]:
            raise ValueError(f"{name} has the entry {short(key)} twice, by name and by number")
        kept[i, j, k] = 0.0
        values[i, k] += _number(name, key, value)
    return kept, values


def entry_of(name: str, key: tuple[Any, ...], structure: Structure) -> tuple[int, int, int]:
    """Numbers i, j, k; raises ValueError for a joint that does not move the link, or is not there."""
    i = structure.joint_index(key[0], f"{name}: joint")
    j = structure.link_index(key[1], f"{name}: link")
    k = structure.joint_index(key[2], f"{name}: coordinate")
    for joint in (i, k):
        if joint not in structure.paths[j]:
            raise ValueError(
                f"{name} has the entry {short(key)}, which is always zero: joint "
                f"{structure.joint_names[joint]!r} does not move link {structure.link_names[j]!r}"
            )
    return i, j, k


def _number(name: str, key: Any, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise TypeError(
            f"{name} of {short(key)} is {short(value)}; give a number, or a whole tensor to learn"
        )
    return float(value)


def _scaled(name: str, scale: Any, structure: Structure) -> tuple[Any, NDArray[Any] | None]:
    """w and, where it is one number for each link, these numbers."""
    if isinstance(scale, Mapping):
        scale = _by_names(name, scale, structure)
    read = numbers_of(name, scale)
    numbers = np.asarray(read.detach().cpu() if has_tensors([read]) else read, float)
    if numbers.shape not in ((), (structure.n, structure.N)):
        raise ValueError(
            f"{name} has shape {numbers.shape}; give a number, ({structure.n}, {structure.N}) for joints and "
            "links, {link: number} or {(joint, link): number}"
        )
    for place in np.argwhere(~(numbers >= 0.0) | np.isinf(numbers)):
        where = (
            f" of ({structure.joint_names[place[0]]}, {structure.link_names[place[1]]})" if len(place) else ""
        )
        raise ValueError(f"{name}{where} is {numbers[tuple(place)]:g}; give 0 or above")
    if not numbers.ndim:
        kept: Any = read if has_tensors([read]) else float(numbers)
        return kept, np.full(structure.N, float(numbers))
    kept = read if has_tensors([read]) else numbers.copy()
    return kept[..., None], _alike(numbers, structure)


def _alike(numbers: NDArray[Any], structure: Structure) -> NDArray[Any] | None:
    columns = [numbers[list(path), j] for j, path in enumerate(structure.paths)]
    if any(len(column) and np.ptp(column) for column in columns):
        return None
    return np.array([column[0] if len(column) else 1.0 for column in columns])


def _by_names(name: str, given: Mapping[Any, Any], structure: Structure) -> NDArray[Any]:
    scale = np.ones((structure.n, structure.N))
    for key, value in given.items():
        if isinstance(key, tuple):
            if len(key) != 2:
                raise ValueError(f"{name} has the key {short(key)}; keys are link or (joint, link)")
            i, j, _ = entry_of(name, (*key, key[0]), structure)
            scale[i, j] = _number(name, key, value)
        else:
            scale[:, structure.link_index(key, f"{name}: link")] = _number(name, key, value)
    return scale
