"""Closed forms that compute with CasADi's symbols, as docs/coming-from-casadi.md says, against Pinocchio."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.answers import random_states, relative_error

pytest.importorskip("pinocchio")

from numeric import oracle_models

PROGRAM = Path(__file__).with_name("casadi_forms.py")


@pytest.mark.skipif(importlib.util.find_spec("casadi") is None, reason="needs casadi: pip install casadi")
def test_closed_forms_in_casadi_and_their_slopes_are_pinocchios(
    directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    folder, joints = directory_of("puma560"), tuple(f"joint{i}" for i in range(1, 7))
    states = random_states(len(joints), 20)
    np.savez(tmp_path / "states.npz", **dict(zip(("q", "qd", "qdd"), states, strict=True)))
    words = sys.executable, PROGRAM, folder, tmp_path / "states.npz", tmp_path / "answers.npz"
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = np.load(tmp_path / "answers.npz")
    expected = oracle_models.decomposition(oracle_models.puma560(), joints, *states)
    assert relative_error(found["torque"], expected["torque"]) <= 1e-14
    assert relative_error(found["slope"], expected["position_gradient"]) <= 1e-14
