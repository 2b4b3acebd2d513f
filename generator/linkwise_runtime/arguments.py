"""Reading of the arguments that every back end accepts, motion and those beside it, and their precision.

    float32, float64    are computed in as they are; in float64 where both occur
    integers, lists     have no precision of their own: they take that of the others, float64 if there is none
    arrays              become tensors, on the device of the others, where tensors are computed
    CPU tensors         become arrays, where arrays are computed, unless a gradient would be lost

All else is refused, and the argument is named: booleans, complex numbers, other floats, masked arrays,
tensors that are not dense, or on different devices. Numbers that belong to a robot or to a controller, and
masks, are converted to that precision.
"""

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .file_joints import FileJoint, why_wider
from .interface import Numbers

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

FLOATS = ("float32", "float64")
INTEGERS = ("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
REAL = ("bool", "int", "uint", "float", "bfloat")
"""Prefixes of the names of dtypes of real numbers."""
ANY = -1
"""Size that stands for an axis of any size."""


class Beside(NamedTuple):
    """An argument given beside the motion, of shape (..., *axes), with samples as the motion has them."""

    value: object
    axes: tuple[int, ...]
    """Sizes of the argument's own axes."""
    meaning: str
    """Description of the entries along these axes."""
    joints: Sequence[str] = ()
    """Names of the entries along the first of these axes, where they are joints."""


NOTHING: Mapping[str, Beside] = {}


def has_tensors(values: Iterable[object]) -> bool:
    """Return whether one of the values is a torch tensor, without importing torch."""
    torch = sys.modules.get("torch")
    return torch is not None and any(isinstance(v, torch.Tensor) for v in values)


def as_array(name: str, value: object) -> NDArray[Any]:
    """Return a value of any kind as an array.

    Raises TypeError or ValueError for a value that does not read as an array, or not without a loss.
    """
    if has_tensors([value]):
        return _array_of_tensor(name, cast("Tensor", value))
    if value is None:
        raise TypeError(f"{name} is None; give an array, a tensor or a list of numbers")
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name} is a masked array; fill its gaps first")
    if isinstance(value, list | tuple) and has_tensors(value):
        raise TypeError(f"{name} is a {type(value).__name__} of tensors; join them with torch.stack")
    try:
        return np.asarray(value)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ValueError(f"{name} does not read as an array: {_first_line(error)}") from None


def refuse_gradient(name: str, value: object) -> None:
    """Raise TypeError for a tensor whose gradient would be lost, as its numbers are read once and kept."""
    if getattr(value, "requires_grad", False):
        raise TypeError(f"{name} requires a gradient, which nothing carries from there; give {name}.detach()")


def kept_numbers(name: str, value: object) -> NDArray[np.float64] | None:
    """Return finite real numbers that are read once and kept; None where they are something else.

    Raises TypeError for a tensor whose gradient would be lost.
    """
    refuse_gradient(name, value)
    try:
        read = as_array(name, value)
    except (TypeError, ValueError):
        return None
    return read.astype(float) if read.dtype.kind in "iuf" and np.isfinite(read).all() else None


def shape_of(value: object) -> tuple[int, ...]:
    """Return the shape of a value that will be read as an array or tensor; () where it is not clear yet."""
    try:
        return tuple(value.shape) if hasattr(value, "shape") else np.shape(cast(ArrayLike, value))
    except (TypeError, ValueError, RuntimeError):
        return ()


def as_weights(name: str, value: object) -> Numbers:
    """Return a tensor as it is, or any other value as an array, of real numbers or truth values.

    Raises TypeError for other numbers, and otherwise as `as_array` does.
    """
    if has_tensors([value]):
        weights = cast(Numbers, value)
    elif value is None:
        raise TypeError(f"{name} is None; give an array, a tensor or a list")
    else:
        weights = as_array(name, value)
    if not _dtype(weights).startswith(REAL):
        raise TypeError(f"{name} has dtype {_dtype(weights)}; give real numbers")
    return weights


def precision(given: Mapping[str, object], read: Mapping[str, Numbers]) -> str:
    """Return the precision to compute in: float32 or float64.

    given: the values as they were given; read: the same as arrays or tensors

    Raises TypeError, which names the argument, for dtypes other than float32, float64 and integers.
    """
    for name, a in read.items():
        if _dtype(a) not in (*FLOATS, *INTEGERS):
            symbols = ", such as float(x) of a number x of SymPy" if _dtype(a) == "object" else ""
            raise TypeError(f"{name} has dtype {_dtype(a)}; give float32, float64 or integers{symbols}")
    own = {_dtype(a) for name, a in read.items() if hasattr(given[name], "dtype")}
    return "float32" if own.intersection(FLOATS) == {"float32"} else "float64"


def check_dense(values: Mapping[str, object]) -> None:
    """Raise TypeError, which names the argument, for a tensor that is not dense, such as a sparse one."""
    for name, value in values.items():
        if has_tensors([value]):
            tensor = cast("Tensor", value)
            if tensor.is_nested:
                raise TypeError(f"{name} is a nested tensor; join its parts with torch.stack or torch.cat")
            if tensor.layout is not sys.modules["torch"].strided:
                raise TypeError(f"{name} has the layout {tensor.layout}; pass {name}.to_dense()")


def as_given(named: Mapping[str, object], beside: Mapping[str, Beside]) -> Mapping[str, object]:
    """Return the motion and the arguments beside it, by name."""
    return {**named, **{name: about.value for name, about in beside.items()}} if beside else named


def check_axes(
    arrays: Mapping[str, Numbers],
    n: int,
    joints: Sequence[FileJoint] = (),
    beside: Mapping[str, Beside] = NOTHING,
) -> None:
    """Raise ValueError, which names the argument, where the axes after those of the samples have wrong sizes.

    n: size of the last axis of motion; joints: those of the file, which explain why positions of a simulator
    have more than n numbers
    """
    for name, a in arrays.items():
        if name in beside:
            _check_own_axes(name, a, beside[name])
        elif a.ndim == 0 or a.shape[-1] != n:
            why = why_wider(joints, a.shape[-1], n) if a.ndim else ""
            told = f" ({why}: robot.from_qpos makes q of it)" if why else ""
            raise ValueError(
                f"{name} has shape {tuple(a.shape)}; its last axis must be {n}, one for each joint{told}"
            )


def _check_own_axes(name: str, a: Numbers, about: Beside) -> None:
    asked, found = about.axes, tuple(a.shape[-len(about.axes) :])
    if len(found) < len(asked) or any(x not in (y, ANY) for x, y in zip(asked, found, strict=True)):
        sizes = ", ".join("X" if size == ANY else str(size) for size in asked)
        axes = "axis" if len(asked) == 1 else "axes"
        raise ValueError(
            f"{name} has shape {tuple(a.shape)}; its last {axes} must be {sizes}: {about.meaning}"
        )


def samples_of(name: str, a: Numbers, beside: Mapping[str, Beside]) -> tuple[int, ...]:
    """Return the shape of the samples of an argument whose own axes have been checked."""
    own = len(beside[name].axes) if name in beside else 1
    return tuple(a.shape[: a.ndim - own])


def no_common_shape(
    arrays: Mapping[str, Numbers], n: int, beside: Mapping[str, Beside] = NOTHING
) -> ValueError:
    """Return the error for arrays (..., n), and arguments beside them, whose samples do not broadcast."""
    shapes = ", ".join(f"{name} {tuple(a.shape)}" for name, a in arrays.items())
    own = "".join(f", {len(about.axes)} of {name}" for name, about in beside.items())
    last = f"the last axes, 1 of motion{own}," if own else f"the last axis, {n} for the joints,"
    return ValueError(f"the shapes do not go together: {shapes}; before {last} axes must be equal or 1")


def too_many_axes(arrays: Mapping[str, Numbers], n: int) -> ValueError:
    """Return the error for arrays (..., n) that have, or whose answers have, too many axes for NumPy."""
    most = max(a.ndim for a in arrays.values())
    names = [name for name, a in arrays.items() if a.ndim == most]
    return ValueError(
        f"{', '.join(names)}: {most} axes are too many for this back end; join those of the samples, as "
        f"{names[0]}.reshape(-1, {n}) does"
    )


def check_numbers(
    given: Mapping[str, object], joint_names: Sequence[str], beside: Mapping[str, Beside] = NOTHING
) -> None:
    """Raise ValueError, which names argument, sample and joint or entry, for the first NaN or infinity."""
    for name, value in as_given(given, beside).items():
        seen = as_array(name, cast("Tensor", value).detach().cpu() if has_tensors([value]) else value)
        wrong = np.argwhere(~np.isfinite(seen))
        if not len(wrong):
            continue
        at: list[int] = wrong[0].tolist()
        own = len(beside[name].axes) if name in beside else 1
        sample, entry = at[: len(at) - own], at[len(at) - own :]
        where = f"at sample {', '.join(map(str, sample))} " if sample else ""
        joints = beside[name].joints if name in beside else joint_names
        what = f"for joint {joints[entry[0]]!r}" if joints else f"in entry {', '.join(map(str, entry))}"
        raise ValueError(f"{name} is {seen[tuple(at)]:g} {where}{what}")


def rising_instants(name: str, value: object) -> list[float]:
    """Return instants in s; raises ValueError, which names them, for what is not a list of rising numbers."""
    instants = as_array(name, value)
    if instants.ndim != 1 or not len(instants) or instants.dtype.kind not in "iuf":
        raise ValueError(
            f"{name} has shape {instants.shape} and dtype {instants.dtype}; give the instants in s, such as "
            "numpy.linspace(0, 1, 101)"
        )
    values: list[float] = instants.astype(float).tolist()
    for k, (one, after) in enumerate(zip(values, [*values[1:], math.inf], strict=True)):
        if not one < after or not math.isfinite(one):
            raise ValueError(
                f"{name}[{k}] is {one:g}; instants must be finite, each later than the one before"
            )
    return values


def _array_of_tensor(name: str, tensor: "Tensor") -> NDArray[Any]:
    check_dense({name: tensor})
    if tensor.requires_grad and sys.modules["torch"].is_grad_enabled():
        raise TypeError(
            f"{name} requires a gradient, which arrays do not carry; load torch, or pass {name}.detach()"
        )
    if tensor.device.type != "cpu":
        raise TypeError(f"{name} lies on {tensor.device}; load torch, or pass {name}.cpu()")
    try:
        array: NDArray[Any] = tensor.detach().resolve_conj().resolve_neg().numpy()
    except ValueError:
        raise too_many_axes({name: tensor}, tensor.shape[-1]) from None
    except TypeError as error:  # a dtype that NumPy lacks
        raise TypeError(f"{name} does not read as an array: {_first_line(error)}") from None
    except RuntimeError:
        raise TypeError(
            f"this needs the numbers of {name}, which torch.func, torch.vmap and torch.export hide; call it "
            "outside of them, or take gradients by torch.autograd"
        ) from None
    return array


def _dtype(a: Numbers) -> str:
    """Return the name of an array's or a tensor's dtype, whatever its byte order."""
    return a.dtype.name if isinstance(a, np.ndarray) else str(a.dtype).removeprefix("torch.")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
