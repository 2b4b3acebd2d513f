"""Robots in TOML, URDF, MJCF and Python, broken."""

import re
from dataclasses import replace
from random import Random

from fuzz.case import NUMPY, Case
from fuzz.mutations import encoded, mutated_data, mutated_text, mutated_xml
from fuzz.valid_robots import random_robot, toml_data, toml_text, urdf_text


def _robot_case(rng: Random, name: str, content: bytes, files: dict[str, bytes] | None = None) -> Case:
    """Mostly `inspect`, which reads; some go on to code or to counted terms."""
    file, chance = f"{{in}}/{name}", rng.random()
    flags: tuple[str, ...] = ()
    for flag in ("--allow-unphysical", "--free-mimic", "--base=floating", "--parameters=symbolic"):
        if rng.random() < 0.15:
            flags = (*flags, flag)
    command: tuple[str, ...] = ("inspect", file)
    if chance < 0.1:
        command = ("generate", file, "--out", "{out}", *NUMPY)
    elif chance < 0.13:
        command = ("generate", file, "--out", "{out}", "--backend", "c", "--backend", "autograd")
    elif chance < 0.15:
        command = ("report", "terms", file, "--budget", "2000", "--out", "{out}")
    elif chance < 0.4:
        command = ("inspect", file, "--json")
    return Case((*command, *flags), {name: content, **(files or {})})


def toml(rng: Random) -> Case:
    """A robot in TOML."""
    data = toml_data(random_robot(rng, rng.randint(1, 3), 6))
    if rng.random() < 0.3:
        data = {**data, "parameters": {"l1": 0.3, "m": 2.0}}
        data["link"][-1] |= {"mass": "m", "com": ["l1/2", "l1*m", 0]}
    text = toml_text(mutated_data(rng, data) if rng.random() < 0.75 else data)
    if rng.random() < 0.35:
        text = mutated_text(rng, text)
    return _robot_case(rng, "robot.toml", encoded(rng, text))


def urdf(rng: Random) -> Case:
    """A robot in URDF."""
    text = urdf_text(random_robot(rng, rng.randint(1, 3), 6))
    if rng.random() < 0.75:
        text = mutated_xml(rng, text)
    if rng.random() < 0.35:
        text = mutated_text(rng, text)
    return _robot_case(rng, "robot.urdf", encoded(rng, text))


MJCF = """<mujoco model="m"><option gravity="0 0 -9.81"/><default><joint damping="0.1"/></default>
<worldbody><body name="a" pos="0 0 1" quat="1 0 0 0">{free}<joint name="j1" type="hinge" axis="0 1 0"/>
<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><geom size="0.1" type="sphere"/>
<body name="b" pos="0.3 0 0"><joint name="j2" type="slide" axis="1 0 0" ref="0.1"/><geom type="capsule"
size="0.05 0.1" mass="0.5"/><site name="s" pos="0 0 0.1"/><body name="c"><joint name="j3" type="ball"/>
<geom type="box" size="0.1 0.2 0.1"/></body></body></body></worldbody>
<equality><joint joint1="j2" joint2="j1" active="false"/></equality>
<actuator><motor joint="j1" gear="2"/></actuator></mujoco>"""


COSTLY = (
    '<asset><texture name="t" type="2d" builtin="checker" width="{0}" height="{0}"/></asset>',
    '<asset><hfield name="t" nrow="{0}" ncol="{0}" size="1 1 1 1"/></asset>',
    '<asset><mesh name="t" builtin="plate" params="{0} {0}"/></asset>',
    '<worldbody><flexcomp name="t" type="grid" count="{0} {0} 1" spacing="1 1 1"/></worldbody>',
    '<include file="/dev/zero"/>',
    '<asset><mesh name="t" file="/dev/zero"/></asset>',
)
"""Elements that may cost MuJoCo gigabytes; their size comes in."""


def mjcf(rng: Random) -> Case:
    """A robot in MJCF."""
    text = MJCF.format(free="" if rng.random() < 0.7 else '<freejoint name="f"/>')
    if rng.random() < 0.2:
        text = text.replace("<equality>", rng.choice(COSTLY).format(10 ** rng.randint(1, 5)) + "<equality>")
    if rng.random() < 0.8:
        text = mutated_xml(rng, text)
    if rng.random() < 0.3:
        text = mutated_text(rng, text)
    return _robot_case(rng, "robot.xml", encoded(rng, text))


ENERGIES = """import sympy as sp
from linkwise import Coordinate, LinkEnergy
x, theta = Coordinate("x", "m"), Coordinate("theta")
M, m, r = sp.symbols("M m r")
coordinates = [x, theta]
links = [
    LinkEnergy("cart", M * x.qd**2 / 2, x.q**2 / 2),
    LinkEnergy("bob", m * (x.qd + r * theta.qd * sp.cos(theta.q)) ** 2 / 2, -m * 9.81 * r * sp.cos(theta.q)),
]
parameters = {M: 2.0, m: 0.3, r: 0.5}
"""
PARTS = (
    "x.qd", "x.q", "theta.q", "x.qdd", "M", "2.0", "0.3", "**2", "sp.nan", "sp.oo", "sp.I", "'x'", "None",
    "[]", "1/0", "0", "sp.Symbol('z')", "x.qd**3", "sp.exp(x.q)", "sp.Abs(x.q)", "sp.sqrt(x.q)",
    "sp.cos(theta.q)", "coordinates", "links", "{}", '"cart"', '"bob"', '"theta"', "float('nan')",
    "10**400", "x", "m", "{m: 0.3}", "sp.Function('f')(x.q)", "True", "sp",
)  # fmt: skip


def energies(rng: Random) -> Case:
    """Energies in Python; the parts put in do nothing but compute."""
    text = ENERGIES
    for _ in range(rng.randint(1, 3)):
        # Whole words, and none that is assigned to: sp.oo = 1 would last for the process.
        found = [re.finditer(rf"(?<!\w){re.escape(part)}(?!\w|(, \w+)* =)", text) for part in PARTS]
        start, end = rng.choice([match.span() for matches in found for match in matches])
        text = text[:start] + rng.choice(PARTS) + text[end:]
    case = _robot_case(rng, "energies.py", encoded(rng, text) if rng.random() < 0.1 else text.encode())
    rigid = ("--allow-unphysical", "--free-mimic", "--base=floating")
    return replace(case, arguments=tuple(part for part in case.arguments if part not in rigid))
