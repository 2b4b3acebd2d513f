"""Covariance of links' inertial parameters, as a file of uncertain bodies has it; `identify` writes it.

[covariance]
note = "..."                 # what the record of an analysis repeats
links = ["upper", "forearm"] # all others have none
parameters = [[...], [...]]  # m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz that the robot has
factor = [[...], ...]        # H, ten rows a link, of the covariance H H^T of these; or matrix, the covariance
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import link_sizes
from linkwise_runtime.quantities import PARAMETERS
from linkwise_runtime.rule.joint_tree import Bodies, JointTree
from linkwise_runtime.rule.regressors import inertial_parameters

from linkwise.arrays import Array
from linkwise.bounded_file import MIB
from linkwise.errors import LinkwiseError
from linkwise.package.decode import known_keys

PLACE = "[covariance]"
KEYS = ("note", "links", "parameters", "factor", "matrix")
MOST = 32 * MIB
"""Largest size in bytes of a file that may have a covariance: those of robots with many links take some."""
APART = 1e-3
"""Part of a link's size up to which parameters count as equal: files have them in other terms, rounded."""


def link_parameters(tree: JointTree) -> Array:
    """Return the inertial parameters of a tree's links, (N, 10), in the terms of `regressor`."""
    values = ([b.mass for b in tree.links], [b.com for b in tree.links], [b.inertia for b in tree.links])
    found: Array = inertial_parameters(Bodies(*(np.array(value, dtype=float) for value in values)))
    return found


def covariance_of(
    data: Mapping[str, Any], places: Callable[[str, Any], list[int]], tree: JointTree | None
) -> tuple[Array | None, str]:
    """Return the covariance (10 N, 10 N) or its factor (N, 10, Q) that a file's data has, and its note.

    They are None and "" where it has none; links that are not named have zeros.

    places: returns the numbers of links by the table's name and their names

    Raises LinkwiseError, which names the table and the key, for what cannot be.
    """
    if "covariance" not in data:
        return None, ""
    assert tree is not None
    table = known_keys(PLACE, data["covariance"], KEYS)
    note = table.get("note", "")
    if not isinstance(note, str) or "\n" in note:
        raise LinkwiseError(f"{PLACE}: note is not a line of text; write one in quotes")
    if ("factor" in table) == ("matrix" in table):
        raise LinkwiseError(f"{PLACE} needs factor or matrix, the one or the other")
    numbers, own = places(PLACE, table.get("links")), link_parameters(tree)
    if "parameters" in table:
        _refuse_others(_matrix(table, "parameters", len(numbers), PARAMETERS), numbers, own, tree)
    rows = PARAMETERS * len(numbers)
    if "matrix" in table:
        at = (PARAMETERS * np.array(numbers)[:, None] + np.arange(PARAMETERS)).reshape(-1)
        whole = np.zeros((own.size, own.size))
        whole[np.ix_(at, at)] = _matrix(table, "matrix", rows, rows)
        return whole, note
    factor = _matrix(table, "factor", rows, None)
    found = np.zeros((*own.shape, factor.shape[1]))
    found[numbers] = factor.reshape(len(numbers), PARAMETERS, -1)
    return found, note


def _matrix(table: Mapping[str, Any], key: str, rows: int, columns: int | None) -> Array:
    given = table[key]
    shaped = isinstance(given, list) and len(given) == rows and all(isinstance(row, list) for row in given)
    wide = len(given[0]) if shaped and columns is None else columns
    if not shaped or any(len(row) != wide for row in given):
        told = "equally many numbers" if columns is None else f"{columns} numbers"
        raise LinkwiseError(
            f"{PLACE}: {key} needs {rows} rows of {told}, as its links have {PARAMETERS} parameters each"
        )
    if any(isinstance(x, bool) or not isinstance(x, (int, float)) for row in given for x in row):
        raise LinkwiseError(f"{PLACE}: {key} holds what is no number")
    return np.array(given, dtype=float)


def _refuse_others(said: Array, numbers: Sequence[int], own: Array, tree: JointTree) -> None:
    """Raise LinkwiseError for parameters that are not the robot's."""
    off = np.abs(said - own[numbers]) / link_sizes(own)[numbers]
    apart = np.argwhere(~(off <= APART)).tolist()
    if apart:
        at, which = apart[0]
        raise LinkwiseError(
            f"{PLACE} is of other bodies than the robot's: {tree.link_name(numbers[at])!r} has "
            f"{own[numbers[at], which]:.6g}, not {said[at, which]:.6g}, for parameter {which + 1} of ten; "
            "take the robot that was written beside the file"
        )
