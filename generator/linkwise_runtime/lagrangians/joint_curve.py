"""A curve of a coordinate that a joint follows, on tensors."""

from collections.abc import Sequence

import torch
from torch import Tensor


class JointCurve:
    """Polynomials in q - start, each from its start on; the first one holds before its start too.

    pieces: coefficients of powers 0, 1, 2, ... for rad or m
    """

    def __init__(self, starts: Sequence[float], pieces: Sequence[Sequence[float]]) -> None:
        size = max(2, *map(len, pieces))
        filled = torch.tensor(
            [(*piece, *[0.0] * (size - len(piece))) for piece in pieces], dtype=torch.float64
        )
        self._starts = torch.tensor(starts, dtype=torch.float64)
        self._pieces = torch.cat([self._starts[:, None], filled], 1)
        self._slopes = torch.cat([self._starts[:, None], (filled * torch.arange(size))[:, 1:]], 1)

    def __call__(self, q: Tensor) -> Tensor:
        """What the joint moves by."""
        return self._value(q, self._pieces)

    def slope(self, q: Tensor) -> Tensor:
        """How that changes with q."""
        return self._value(q, self._slopes)

    def _value(self, q: Tensor, pieces: Tensor) -> Tensor:
        """For rows of a start and the coefficients from there on."""
        piece = (q.detach().unsqueeze(-1) >= self._starts[1:].to(q)).sum(-1)
        start, *coefficients = torch.nn.functional.embedding(piece, pieces.to(q)).unbind(-1)
        value = coefficients[-1]
        for coefficient in reversed(coefficients[:-1]):
            value = value * (q - start) + coefficient
        return value
