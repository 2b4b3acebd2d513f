"""Calls of a robot as torch compiles and exports them, and in ONNX; docs/exports.md has their table."""

import inspect
import io
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import torch
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

PAGE = Path(__file__).parents[2] / "docs/exports.md"
WAYS = ("compile", "export", "ONNX")

FORCE = torch.tensor([1.0, 2.0, 3.0])
MASK = torch.tensor([[1.0], [0.0], [1.0]])
FIXED: dict[str, Callable[[Any], dict[str, Any]]] = {
    "masked": lambda robot: {"mask": MASK.expand(3, robot.n)},
    "simulate": lambda robot: {"time": [0.0, 0.01], "tau": None},
    "trace": lambda robot: {"time": [0.0, 0.01, 0.02], "tau": None},
    "counterfactual": lambda robot: {"time": [0.0, 0.01, 0.02], "without": "gravity", "tau": None},
    "uncertainty": lambda robot: {"bodies": UncertainBodies(masses=0.1, centres=0.01)},
    "kinematics.load_torque": lambda robot: {"frame": robot.N - 1, "force": FORCE},
}
"""Arguments of calls besides positions, velocities, accelerations and torques."""
KINEMATICS = ("pose", "jacobian", "jacobian_rate", "velocity", "acceleration")
FIXED |= {f"kinematics.{call}": lambda robot: {"frame": robot.N - 1} for call in KINEMATICS}


def module_of(robot: Any, call: str) -> tuple[Any, int]:
    """The call as a module, and how many arguments (samples, n) it is given."""
    module = robot.module(call, **FIXED.get(call, lambda robot: {})(robot))
    given = inspect.signature(module.forward).parameters.values()
    needed = [p for p in given if p.default is p.empty or p.name == "tau"]
    return module, len(needed)


def motion(robot: Any, count: int, samples: int, seed: int = 0) -> tuple[Any, ...]:
    draw = np.random.default_rng(seed)
    # Small enough for positions of a motion, which may not leap.
    return tuple(torch.from_numpy(draw.uniform(-0.4, 0.4, (samples, robot.n))) for _ in range(count))


def results(answer: Any) -> list[Any]:
    """Tensors of an answer, one or several by name."""
    return [answer] if torch.is_tensor(answer) else [a for a in answer.values() if torch.is_tensor(a)]


def error(found: Any, expected: Any) -> float:
    """Largest difference in a ratio to the largest magnitude of each result."""
    pairs = list(zip(results(found), results(expected), strict=True))
    assert all(a.shape == b.shape and a.dtype == b.dtype for a, b in pairs)
    errors = (float((a - b).abs().max() / b.abs().max().clamp(min=1e-9)) for a, b in pairs if b.numel())
    return max(errors, default=0.0)


def any_samples(count: int) -> tuple[Any, ...]:
    """Dynamic shapes of so many arguments that share their number of samples."""
    return ({0: torch.export.Dim("samples")},) * count


def exported(module: Any, given: Sequence[Any]) -> Any:
    """The module exported for any number of samples, saved, and loaded again."""
    program = torch.export.export(module, tuple(given), dynamic_shapes=any_samples(len(given)))
    torch.export.save(program, place := io.BytesIO())
    place.seek(0)
    return torch.export.load(place)


def in_onnx(program: Any) -> Callable[..., list[Any]]:
    """An exported program under onnxruntime."""
    translated = torch.onnx.export(program, dynamo=True, verbose=False)
    session = onnxruntime.InferenceSession(translated.model_proto.SerializeToString())
    names = [given.name for given in session.get_inputs()]

    def run(*given: Any) -> list[Any]:
        arrays = {name: a.numpy() for name, a in zip(names, given, strict=True)}
        return [torch.from_numpy(a) for a in session.run(None, arrays)]

    return run


def table() -> Iterator[tuple[str, dict[str, bool]]]:
    """Each call of the page's table, and whether it goes each way."""
    for row in re.findall(r"^\| (`.*) \|$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE):
        calls, *cells = row.split(" | ")
        for call in re.findall(r"`([\w.]+)`", calls):
            yield call, {way: cell == "yes" for way, cell in zip(WAYS, cells, strict=True)}
