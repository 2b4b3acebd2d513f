"""Random states, answers of any back end as NumPy arrays, and errors in a ratio to the largest magnitude."""

from pathlib import Path
from typing import Any

import numpy as np


def random_states(n: int, samples: int, seed: int = 0) -> tuple[Any, Any, Any]:
    """Return q in ±π and q̇, q̈ in ±2, each of shape (samples, n)."""
    generator = np.random.default_rng(seed)
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    qd, qdd = generator.uniform(-2.0, 2.0, (2, samples, n))
    return q, qd, qdd


def relative_error(value: Any, reference: Any) -> float:
    """Return the largest difference, in a ratio to the largest magnitude of `reference`."""
    value, reference = np.asarray(value), np.asarray(reference)
    assert value.shape == reference.shape
    if reference.size == 0:
        return 0.0
    return float(np.abs(value - reference).max() / np.abs(reference).max())


def packed(package: Any, directory: Path, backend: str, q: Any, qd: Any, qdd: Any) -> dict[str, Any]:
    """Packed c2, c1, g, tau and c0 of a back end, "numpy by rule" say; `c` is compiled first."""
    if backend == "c":
        from helpers.compiled import Compiled

        library = Compiled(directory)
        answer = library.decomposition(q, qd, qdd)
        return answer | {"position_gradient": library.position_gradient(q, qd, qdd)}
    name, _, kernel = backend.partition(" by ")
    dynamics = package.load(name, kernel=kernel or "auto")
    motion = (q, qd, qdd)
    if dynamics.backend.takes_tensors:
        import torch

        motion = tuple(torch.from_numpy(m) for m in motion)
    answer = dynamics.packed(*motion)
    dense = np.asarray(dynamics.position_gradient(*motion))
    fields = ("acceleration", "velocity", "gravity", "torque")
    named = {field: np.asarray(getattr(answer, field)) for field in fields}
    return named | {"position_gradient": dense[:, *dynamics.layout.velocity.T]}
