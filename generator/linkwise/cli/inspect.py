"""What a robot is made of, as data and as text."""

from typing import Any

from linkwise.emit.assemble import rigid_tree
from linkwise.symbolic.system import RigidSystem, System


def inspection(system: System) -> dict[str, Any]:
    """Joints, links, parameters and the reader's notes, ready for JSON."""
    tree = rigid_tree(system)
    mass = {body.link: body.mass for body in tree.bodies} if tree else {}
    notes = system.robot.notes if isinstance(system, RigidSystem) else ()
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
        "notes": [{"kind": n.kind, "subject": n.subject, "detail": n.detail} for n in notes],
    }


def table(data: dict[str, Any]) -> str:
    """Lines for a person."""
    lines = [f"{data['name']}: {len(data['joints'])} joints, {len(data['links'])} links"]
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
                lines.append(f"  {note['subject']} {note['detail']}".rstrip())
    return "\n".join(lines)
