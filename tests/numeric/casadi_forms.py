"""Closed forms with CasADi's symbols, in a process of its own, as OpenSim brings another CasADi into one.

`python casadi_forms.py FOLDER STATES ANSWERS`: FOLDER holds a generated package, STATES q, qd and qdd (S, n)
as an .npz file; ANSWERS will hold torque (S, i, j) and slope (S, i, j, k) = dtorque/dq of it.
"""

import importlib
import sys
from pathlib import Path

import casadi as ca
import numpy as np


def written(folder: Path, states: Path, answers: Path) -> None:
    sys.path.insert(0, str(folder.parent))
    given = np.load(states)
    rows = [given[name] for name in ("q", "qd", "qdd")]
    s, n = rows[0].shape
    symbols = [ca.SX.sym(name, n) for name in ("q", "qd", "qdd")]
    elements = [np.array(ca.vertsplit(part), dtype=object) for part in symbols]
    torque, slope = np.zeros((s, n, n)), np.zeros((s, n, n, n))
    for j in range(n):
        link = importlib.import_module(f"{folder.name}.forms.link_{j + 1}")
        form = ca.vertcat(*link.torque(ca, *elements, {}))
        function = ca.Function("link", symbols, [form, ca.jacobian(form, symbols[0])])
        for at, state in enumerate(zip(*rows, strict=True)):
            value, gradient = (answer.full() for answer in function(*state))
            torque[at, link.PATH, j] = value[:, 0]
            slope[at, link.PATH, j] = gradient
    np.savez(answers, torque=torque, slope=slope)


if __name__ == "__main__":
    written(*map(Path, sys.argv[1:]))
