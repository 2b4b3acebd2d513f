"""Numbers of a tree of joints as arrays: its own, formulas of run-time parameters, bodies in their place.

Samples are innermost; what all of them share has one. See `kinematics` for `xp`.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import precision
from ..interface import Namespace, Numbers
from ..parameter_values import fits
from .joint_tree import Bodies, JointTree, Own, formulas_of

SHAPES = {"masses": (), "centres": (3,), "inertias": (3, 3)}
"""Shape of each field of `Bodies` for one link."""


class TreeArrays(NamedTuple):
    """Numbers of a tree."""

    gravity: Numbers
    """Gravity in the base's axes, (3, 1, samples)."""
    translations: Numbers
    """Translation of each frame, zero for the ground, (3, frames, samples)."""
    masses: Numbers
    """(N, samples)"""
    centres: Numbers
    """(3, N, samples)"""
    inertias: Numbers
    """(3, 3, N, samples)"""
    offsets: Numbers
    """Origins of the frames that have names, in the axes of what carries them, (3, frames, samples)."""

    @property
    def bodies(self) -> tuple[Numbers, Numbers, Numbers]:
        """Masses, centres and inertias of the links."""
        return self.masses, self.centres, self.inertias


def own_numbers(tree: JointTree) -> TreeArrays:
    """Return the numbers as listed, in float64."""
    return TreeArrays(
        np.array(tree.gravity)[:, None, None],
        np.array([*(joint.translation for joint in tree.joints), (0.0, 0.0, 0.0)]).T[..., None],
        np.array([link.mass for link in tree.links])[:, None],
        np.array([link.com for link in tree.links]).T[..., None],
        np.array([link.inertia for link in tree.links]).transpose(1, 2, 0)[..., None],
        np.array([frame.translation for frame in tree.frames]).reshape(-1, 3).T[..., None],
    )


def formula_sources(tree: JointTree) -> NDArray[np.intp]:
    """Return for every number its position in all listed ones followed by those of the formulas, flat."""
    listed = {place: at for at, place in enumerate(_places(tree))}
    sources = np.arange(len(listed))
    for number, place in enumerate(formulas_of(tree)):
        sources[listed[place]] = len(listed) + number
    return sources


def _places(tree: JointTree) -> Iterator[str]:
    """Yield the names of the numbers, in the order of `own_numbers`."""
    frames, links = range(len(tree.joints) + 1), range(len(tree.links))
    yield from (f"gravity[{i}]" for i in range(3))
    yield from (f"joints[{f}].translation[{i}]" for i in range(3) for f in frames)
    yield from (f"links[{j}].mass" for j in links)
    yield from (f"links[{j}].com[{i}]" for i in range(3) for j in links)
    yield from (f"links[{j}].inertia[{i}][{k}]" for i in range(3) for k in range(3) for j in links)
    yield from (f"frames[{f}].translation[{i}]" for i in range(3) for f in range(len(tree.frames)))


def _with_formulas(
    xp: Namespace,
    tree: JointTree,
    own: TreeArrays,
    sources: Numbers,
    p: Mapping[str, Numbers],
    batch: tuple[int, ...],
) -> TreeArrays:
    """Return the numbers for values of the parameters, each one for all samples or one for each, (...)."""
    formulas = formulas_of(tree)
    if not formulas:
        return own
    values = [formula(xp, p) for formula in formulas.values()]
    if any(value.ndim for value in values):
        columns = xp.stack([xp.broadcast_to(value, batch).reshape(-1) for value in values], 0)
    else:
        columns = xp.stack(values, 0)[:, None]
    listed = xp.concat([a.reshape(-1, 1) for a in own], 0)
    flat = xp.concat([xp.broadcast_to(listed, (len(listed), columns.shape[1])), columns], 0)[sources]
    found, at = [], 0
    for a in own:
        shape = tuple(a.shape[:-1])
        size = math.prod(shape)
        found.append(flat[at : at + size].reshape(*shape, flat.shape[1]))
        at += size
    return TreeArrays(*found)


def _with_bodies(
    xp: Namespace, numbers: TreeArrays, bodies: Bodies[Numbers], batch: tuple[int, ...]
) -> TreeArrays:
    """Return the numbers with bodies in place of the tree's.

    Bodies may have axes of the batch in front.
    """
    given: dict[str, Numbers] = {}
    for name, value in bodies._asdict().items():
        own = len(SHAPES[name]) + 1
        shape = tuple(value.shape[len(value.shape) - own :])
        if value.ndim > own:
            fits(f"bodies.{name}", value.shape[: value.ndim - own], batch)
            value = xp.broadcast_to(value, (*batch, *shape)).reshape(-1, *shape)
        else:
            value = value[None]
        # (samples, N, ...) -> (..., N, samples): N to the front, then both to the end, one axis after another
        for axis in range(value.ndim - 1):
            value = xp.swapaxes(value, axis, axis + 1)
        for axis in range(value.ndim - 2):
            value = xp.swapaxes(value, axis, axis + 1)
        given[name] = value
    return numbers._replace(**given)


def given_numbers(
    xp: Namespace,
    tree: JointTree,
    own: tuple[TreeArrays, Numbers],
    p: Mapping[str, Numbers],
    bodies: Bodies[Numbers] | None,
    batch: tuple[int, ...],
) -> TreeArrays:
    """Return the numbers for values of the parameters and, where they are given, bodies.

    own: `own_numbers` and `formula_sources` of the tree, to compute with
    """
    numbers = _with_formulas(xp, tree, *own, p, batch)
    return numbers if bodies is None else _with_bodies(xp, numbers, bodies, batch)


def checked_bodies(given: object, links: int, read: Callable[[str, object], Own]) -> Bodies[Own]:
    """Return bodies of the arrays or tensors that `read` makes by name.

    Arrays are copied, tensors may be learned. Raises TypeError for what is not numbers, and ValueError for a
    wrong shape.
    """
    if not isinstance(given, tuple) or len(given) != len(SHAPES):
        raise TypeError(
            f"bodies is {type(given).__name__}; give Bodies(masses, centres, inertias), such as the "
            "package's bodies()"
        )
    values = {f"bodies.{name}": value for name, value in zip(SHAPES, given, strict=True)}
    for (name, value), inner in zip(values.items(), SHAPES.values(), strict=True):
        if value is None:
            raise TypeError(f"{name} is None; give an array or a tensor of shape {(links, *inner)}")
    found = {name: read(name, value) for name, value in values.items()}
    precision(found, found)
    for (name, array), inner in zip(found.items(), SHAPES.values(), strict=True):
        shape = (links, *inner)
        if tuple(array.shape[-len(shape) :]) != shape:
            raise ValueError(
                f"{name} has shape {tuple(array.shape)}; it must be {shape}, or that behind axes of samples"
            )
    return Bodies(*(a.copy() if isinstance(a, np.ndarray) else a for a in found.values()))
