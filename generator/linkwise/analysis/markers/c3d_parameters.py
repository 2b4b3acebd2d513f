"""Parameters of a C3D file, as ezc3d reads them: texts, with all their parts, and numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

PART = 255
"""Most that a parameter holds; LABELS2 has those after the first 255 of LABELS."""


class C3DParameters:
    """Parameters of a file, by group and name; `file` is what ezc3d gives."""

    def __init__(self, file: Any) -> None:
        self._groups = file["parameters"]

    def numbers(self, group: str, name: str) -> Array:
        """Return the numbers of a parameter in the shape of the file, flat and empty where it has none."""
        return np.atleast_1d(np.asarray(self._values(group, name), dtype=float))

    def texts(self, group: str, name: str) -> list[str]:
        """Return the texts of a parameter and of its further parts, as `LABELS2`, without spaces around."""
        return [decoded(str(text)).strip() for text in self._of_parts(group, name, "")]

    def of_channels(self, name: str) -> Array:
        """Return the numbers (C,) of a parameter in ANALOG and of its further parts, 0 where one is short."""
        return np.array(self._of_parts("ANALOG", name, 0.0), dtype=float)

    def text(self, group: str, name: str) -> str:
        """Return the first text of a parameter, empty where it has none."""
        return next(iter(self.texts(group, name)), "")

    def of_plate(self, number: int, name: str, *shape: int) -> Array:
        """Return the numbers in FORCE_PLATFORM that are those of a plate, counted from 1.

        shape: of one plate's numbers; -1 for as many as there are

        Raises LinkwiseError where the file has fewer, or in another shape.
        """
        values = self.numbers("FORCE_PLATFORM", name)
        is_other = len(shape) > 1 and values.ndim > len(shape) and values.shape[: len(shape)] != shape
        if shape == (-1,):
            shape = (values.shape[0],) if values.ndim == 2 else (values.size,)
        flat, size = values.ravel(order="F"), int(np.prod(shape))
        own = flat[size * (number - 1) : size * number]
        if is_other or not size or len(own) < size:
            raise LinkwiseError(
                f"plate {number}: FORCE_PLATFORM:{name} has not its {size} numbers; export the file again"
            )
        return own.reshape(shape, order="F")

    def _of_parts(self, group: str, name: str, lacking: Any) -> list[Any]:
        found: list[Any] = []
        part = 1
        while len(values := self._values(group, f"{name}{part}" if part > 1 else name)):
            found += [lacking] * (PART * (part - 1) - len(found))
            found += list(values)
            part += 1
        return found

    def _values(self, group: str, name: str) -> Sequence[Any]:
        found: Sequence[Any] = self._groups.get(group, {}).get(name, {}).get("value", ())
        return found


def decoded(text: str) -> str:
    """Return a text of which ezc3d took bytes for UTF-8 that are Latin-1."""
    raw = text.encode("utf-8", "surrogateescape")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")
