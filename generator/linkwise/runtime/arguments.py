"""What every back end asks of its arguments."""

from collections.abc import Mapping

from .interface import Array


def same_kind(arrays: Mapping[str, Array], n: int) -> Mapping[str, Array]:
    """Return the arrays if their last axis is n and their dtypes agree; else raise, naming the argument."""
    first_name, first = next(iter(arrays.items()))
    for name, a in arrays.items():
        if a.ndim == 0 or a.shape[-1] != n:
            raise ValueError(
                f"{name} has shape {tuple(a.shape)}; its last axis must be {n}, one for each joint"
            )
        if a.dtype != first.dtype:
            raise TypeError(f"{name} has dtype {a.dtype}, {first_name} has {first.dtype}; give them the same")
    return arrays
