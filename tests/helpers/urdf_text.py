"""URDF written by tests: links of one mass, joints in a line each."""

LINK = """<link name="{name}"><inertial><origin xyz="0.1 -0.02 0.05" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
<inertia ixx="0.03" iyy="0.04" izz="0.05" ixy="0.001" ixz="-0.002" iyz="0.003"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/>{inner}</joint>"""
USUAL = {"type": "revolute", "xyz": "0.2 0.1 0.3", "rpy": "0.4 -0.3 0.2", "axis": "0 0.6 0.8", "inner": ""}


def link(name: str, mass: str = "1.5") -> str:
    return LINK.format(name=name, mass=mass)


def joint(name: str, parent: str, child: str, **changes: str) -> str:
    return JOINT.format(**(USUAL | changes), name=name, parent=parent, child=child)


def mimic(master: str, ratio: float = 1.0, offset: float = 0.0) -> str:
    return f'<mimic joint="{master}" multiplier="{ratio}" offset="{offset}"/>'


def robot(*parts: str) -> str:
    return f'<robot name="test">{"".join(parts)}</robot>'


def chain(*joints: str) -> str:
    """Links a, b, c, … with the given joints."""
    return robot(*(link("abcdefgh"[k]) for k in range(len(joints) + 1)), *joints)
