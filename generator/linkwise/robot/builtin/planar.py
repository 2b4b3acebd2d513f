"""The planar arms of the paper: planar3 is Table 2, planarN its continuation to N equal links."""

import sympy as sp

from linkwise.robot.description import ZERO3, Body, Connection, Description

LENGTH, CENTRE, MASS, INERTIA = 0.250, 0.125, 0.600, 5.00e-3  # Table 2: m, m, kg, kg·m²
GRAVITY = 9.80665  # m/s², in the plane


def planar(n: int) -> Description:
    """Return an arm of n revolute joints about z with relative angles.

    The arm lies along x at zero, gravity along −y. Link j has length l_j, centre of mass r_j along it, mass
    m_j and moment I_j about its centre of mass.
    """
    bodies, connections = [Body("base")], list[Connection]()
    parameters: list[tuple[str, float]] = []
    for j in range(1, n + 1):
        values = {f"l_{j}": LENGTH, f"r_{j}": CENTRE, f"m_{j}": MASS, f"I_{j}": INERTIA}
        r, m, moment = (sp.Symbol(name, real=True) for name in list(values)[1:])
        parameters += values.items()
        # A thin bar along x: the moment about y never enters a planar motion.
        inertia = (ZERO3, (0.0, moment, 0.0), (0.0, 0.0, moment))
        bodies.append(Body(f"link{j}", m, (r, 0.0, 0.0), inertia))
        start = (sp.Symbol(f"l_{j - 1}", real=True), 0.0, 0.0) if j > 1 else ZERO3
        connections.append(
            Connection(f"joint{j}", "revolute", bodies[-2].name, bodies[-1].name, translation=start)
        )
    return Description(
        f"planar{n}",
        tuple(bodies),
        tuple(connections),
        (0.0, -GRAVITY, 0.0),
        tuple(parameters),
        only_named=True,
    )
