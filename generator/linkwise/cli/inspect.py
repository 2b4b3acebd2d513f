"""The command `inspect`: what a robot is made of, as data and as text."""

from collections.abc import Collection
from dataclasses import asdict
from typing import Annotated, Any

import typer

from linkwise import pipeline
from linkwise.cli import Json, counted
from linkwise.cli.options import RobotName, reads_robot
from linkwise.emit.assemble import rigid_tree
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, printable
from linkwise.robot import Options
from linkwise.symbolic.system import EnergySystem, System

LOSSES = ("damping", "friction")
"""Kinds of notes that are shown on request."""

app = typer.Typer(add_completion=False)


@app.command()
@reads_robot()
def inspect(
    robot: RobotName,
    options: Options,
    joint_friction: Annotated[
        bool,
        typer.Option(
            "--joint-friction", help="Also list the joints' damping and friction, which no torque holds"
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Show a robot's joints, links and parameters, and what was merged, locked or ignored."""
    system = pipeline.read_system(robot, options)
    if joint_friction and isinstance(system, EnergySystem):
        raise LinkwiseError(f"{robot}: energies in Python do not accept --joint-friction; leave it out")
    data = inspection(system, () if joint_friction else LOSSES)
    print(json_text(data, indent=1) if as_json else table(data))


def inspection(system: System, hidden: Collection[str] = LOSSES) -> dict[str, Any]:
    """Joints, links, parameters and the notes of the kinds that are not hidden, ready for JSON."""
    tree = rigid_tree(system)
    mass = {body.link: body.mass for body in tree.bodies} if tree else {}
    return {
        "name": system.name,
        "joints": [{"name": c.name, "unit": c.unit} for c in system.coordinates],
        "links": [
            {
                "name": name,
                "path": [system.coordinates[k].name for k in system.path(j)],
                "mass": mass.get(name),
            }
            for j, name in enumerate(system.link_names)
        ],
        "parameters": {s.name: float(v) for s, v in system.parameters.items()},
        "notes": [asdict(note) for note in system.notes if note.kind not in hidden],
    }


def table(data: dict[str, Any]) -> str:
    """Lines for a person."""
    lines = [
        f"{data['name']}: {counted(len(data['joints']), 'joint')}, {counted(len(data['links']), 'link')}"
    ]
    lines += ["", "joints"]
    lines += [f"  {k}  {c['name']} [{c['unit']}]" for k, c in enumerate(data["joints"], 1)]
    lines += ["", "links (mass; moved by)"]
    for k, link in enumerate(data["links"], 1):
        mass = "" if link["mass"] is None else f"{link['mass']:.6g} kg; "
        lines.append(f"  {k}  {link['name']}  ({mass}{', '.join(link['path'])})")
    if data["parameters"]:
        lines += [
            "",
            "parameters",
            *(f"  {name} = {value:g}" for name, value in data["parameters"].items()),
        ]
    for kind in dict.fromkeys(note["kind"] for note in data["notes"]):
        lines += ["", kind]
        for note in data["notes"]:
            if note["kind"] == kind:
                effect = f"; {note['effect']}" if note["effect"] else ""
                lines.append(f"  {note['subject']} {note['detail']}".rstrip() + effect)
    return "\n".join(map(printable, lines))
