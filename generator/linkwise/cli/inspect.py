"""The command `inspect`: what a robot is made of, as data and as text."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Annotated, Any

import typer
from linkwise_runtime.rule.joint_tree import JointTree
from linkwise_runtime.structure import IMPOSED_MOTION

from linkwise import pipeline
from linkwise.cli import Json, counted
from linkwise.cli.flags import RobotName, is_given, takes, tell_run
from linkwise.cli.inspect_gravity import gravity_line, is_loaded
from linkwise.cli.inspect_identifiable import Identifying, identified, identified_text
from linkwise.cli.inspect_page import SHARES, SUBJECTS, page, varying
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, listed, printable
from linkwise.progress import progress as shown_progress
from linkwise.robot import Options, kept_apart, left_out
from linkwise.robot.robot import Parameter
from linkwise.symbolic.definition import exact_text, joint_entries, joint_tree
from linkwise.symbolic.system import EnergySystem, Share, System

LESS = "…"
"""Text in place of an end that a joint does not have."""
ALLOWING = "--allow-unphysical"
"""Flag that is named wherever a body that cannot exist is refused."""

REFUSED = f"refused without {ALLOWING}"
"""Effect of such a body, where it was refused."""

app = typer.Typer(add_completion=False)


@app.command()
@takes(parameters="symbolic")
def inspect(
    context: typer.Context,
    robot: RobotName,
    options: Options,
    identifying: Identifying,
    details: Annotated[
        bool,
        typer.Option("--details", help="Show every joint, link, constraint, frame, parameter and remark"),
    ] = False,
    as_json: Json = False,
) -> None:
    """Show a robot's joints, links, parameters, and what was merged, locked, ignored or left out."""
    if identifying.identifiable:
        with shown_progress() as progress:
            found = identified(robot, options, identifying, details, progress)
        tell_run(robot)
        print(json_text(found, indent=1) if as_json else identified_text(found))
        return
    system, refused = _system(robot, options, not is_given(context, "parameters"))
    tell_run(robot)
    data = inspection(system, details, refused)
    if as_json:
        print(json_text(data, indent=1))
    elif details:
        print(table(data))
    else:
        tree = joint_tree(system)
        ground = [frame.name for frame in tree.frames if frame.joint is None] if tree else None
        print(page(data, ground, _joint, _moved_link, _constraint, _share))


def _system(robot: str, options: Options, as_made: bool) -> tuple[System, str]:
    """Return the system, and why `generate` refuses it as impossible, or else an empty string."""
    try:
        return pipeline.read_system(robot, options, as_made), ""
    except LinkwiseError as error:
        refused = str(error)
        if ALLOWING not in refused:  # it would cost the same again, to be refused again
            raise
        try:
            return pipeline.read_system(robot, replace(options, allow_unphysical=True)), refused
        except LinkwiseError:
            raise error from None


def inspection(system: System, details: bool = False, refused: str = "") -> dict[str, Any]:
    """Return joints, links, parameters and notes, ready for JSON.

    With `details` frames and each joint's notes are there too. `refused` says why `generate` refuses the
    robot.
    """
    tree = joint_tree(system)
    notes = system.notes
    if refused:  # so that nothing was accepted
        notes = tuple(replace(note, effect=REFUSED) if note.kind == "unphysical" else note for note in notes)
    if not details:
        others = (note for note in notes if note.kind not in ("left out", "passive"))
        notes = (*others, *kept_apart(notes), *left_out(notes))
    mass = {tree.link_name(j): link.mass for j, link in enumerate(tree.links)} if tree else {}
    return {
        "name": system.name,
        **({"gravity": list(tree.gravity), "gravity_loads": is_loaded(tree)} if tree else {}),
        "joints": [asdict(joint) for joint in joint_entries(system)],
        "links": [
            {
                "name": name,
                "path": [system.coordinates[k].name for k in system.path(j)],
                "mass": mass.get(name),
            }
            for j, name in enumerate(system.link_names)
        ],
        **(
            _constraints(tree, [c.name for c in system.coordinates]) if tree else _written_constraints(system)
        ),
        **_shares(system),
        **({"frames": _frames(tree)} if details and tree else {}),
        "parameters": [asdict(parameter) for parameter in parameters(system)],
        "notes": [asdict(note) for note in notes],
        "refused": refused,
    }


def _shares(system: System) -> dict[str, Any]:
    """Return what each named share of energies is made of, time and inputs; empty for rigid bodies."""
    if not isinstance(system, EnergySystem):
        return {}
    found = [
        {
            "name": name,
            "kinds": [*dict.fromkeys(kind for _, share in own for kind in _kinds(share))],
            "links": [link for link, _ in own],
        }
        for name in system.share_names
        for own in [
            [(link.name, share) for link in system.links for share in link.shares if share.name == name]
        ]
    ]
    varying = {
        "time": None if system.time is None else system.time.name,
        "inputs": [symbol.name for symbol in system.inputs],
    }
    return {"shares": found, **varying}


def _kinds(share: Share) -> list[str]:
    """Return what a share is given by."""
    if share.name == IMPOSED_MOTION:
        return ["kinetic energy"]
    given = {
        "potential": share.potential != 0 or share.motion != 0,
        "dissipation": share.dissipation != 0,
        "force": bool(share.forces),
    }
    return [kind for kind, is_there in given.items() if is_there]


def _written_constraints(system: System) -> dict[str, Any]:
    """Return the constraints that a user wrote, as `_constraints` does; empty without any."""
    if not isinstance(system, EnergySystem) or not system.constraints:
        return {}
    constraints = [
        {
            "name": one.name,
            "kind": "positions" if one.holonomic else "velocities",
            "expression": f"{exact_text(one.expression)} = 0",
        }
        for one in system.constraints
    ]
    return {"constraints": constraints, **_moved([c.name for c in system.coordinates], system.independent)}


def _constraints(tree: JointTree, joints: Sequence[str]) -> dict[str, Any]:
    """Return the constraints, and the joints that then move all others; empty without constraints."""
    if not tree.independent:
        return {}
    ties = (
        {"name": tie.name, "kind": tie.kind, "ends": [tree.frames[at].name for at in (tie.first, tie.second)]}
        | ({"length": tie.length} if tie.kind == "distance" else {})
        for tie in tree.ties
    )
    couplings = (
        {"name": c.name, "kind": "coupling", "terms": {joints[k]: list(factors) for k, factors in c.terms}}
        for c in tree.couplings
    )
    return {"constraints": [*ties, *couplings], **_moved(joints, tree.independent)}


def _moved(joints: Sequence[str], independent: Sequence[int]) -> dict[str, list[str]]:
    """Return the joints that move freely, and those that follow them."""
    return {
        "independent": [joints[k] for k in independent],
        "dependent": [joint for k, joint in enumerate(joints) if k not in independent],
    }


def _frames(tree: JointTree) -> list[dict[str, str | None]]:
    """Return the frames that kinematics knows by name, each with its moving link; None for the ground."""
    return [
        {"name": frame.name, "link": None if frame.joint is None else tree.joints[frame.joint].link}
        for frame in tree.frames
    ]


def parameters(system: System) -> tuple[Parameter, ...]:
    """Return the run-time parameters: values in the file, units and meanings."""
    if isinstance(system, EnergySystem):
        told = {system.time: "time"} | dict.fromkeys(system.inputs, "an input, given from outside")
        return tuple(
            Parameter(s.name, float(v), "", told.get(s, "of the energies"))
            for s, v in system.parameters.items()
        )
    return system.robot.parameters


def table(data: dict[str, Any]) -> str:
    """Return all of `inspection`'s data as lines for a person."""
    lines = [
        f"{data['name']}: {counted(len(data['joints']), 'joint')}, {counted(len(data['links']), 'link')}"
    ]
    if "gravity" in data:
        lines.append(gravity_line(data))
    if data["refused"]:
        lines += ["", f"refused by generate: {data['refused']}"]
    lines += ["", "joints"]
    lines += [_joint(k, joint) for k, joint in enumerate(data["joints"], 1)]
    lines += ["", "links (mass; moved by)"]
    lines += [_link(k, link) for k, link in enumerate(data["links"], 1)]
    if "constraints" in data:
        lines += ["", "constraints (of `robot.constraints`; on what)"]
        lines += [_constraint(k, constraint) for k, constraint in enumerate(data["constraints"], 1)]
        lines.append(f"  independent: {', '.join(data['independent'])}")
        lines.append(f"  dependent: {', '.join(data['dependent'])}")
    if data.get("shares"):
        lines += ["", SHARES, *(_share(k, share) for k, share in enumerate(data["shares"], 1))]
    lines += varying(data)
    if "frames" in data:
        lines += ["", "frames (of `kinematics`; on which link)"]
        lines += [f"  {f['name']}  ({f['link'] or 'the ground'})" for f in data["frames"]]
    if data["parameters"]:
        heads = [f"{p['name']} = {p['value']:.6g} {p['unit']}".rstrip() for p in data["parameters"]]
        width = max(map(len, heads))
        lines += ["", "parameters (of `load`, generated with --parameters symbolic or nonzero)"]
        lines += [f"  {h:<{width}}  {p['meaning']}" for h, p in zip(heads, data["parameters"], strict=True)]
    kinds = dict.fromkeys(note["kind"] for note in data["notes"] if note["kind"] != "constraint")
    for kind in kinds:
        lines += ["", kind]
        for note in data["notes"]:
            if note["kind"] == kind:
                effect = f"; {note['effect']}" if note["effect"] else ""
                lines.append(f"  {note['subject']} {note['detail']}".rstrip() + effect)
    return "\n".join(map(printable, lines))


def _joint(number: int, joint: dict[str, Any]) -> str:
    return f"  {number}  {joint['name']} [{joint['unit']}]{_limits(joint)}"


def _link(number: int, link: dict[str, Any], most: int | None = None) -> str:
    mass = "" if link["mass"] is None else f"{link['mass']:.6g} kg; "
    path = link["path"]
    return f"  {number}  {link['name']}  ({mass}{listed(path, len(path) if most is None else most)})"


def _moved_link(number: int, link: dict[str, Any]) -> str:
    """Return the row of a link, with the first of the joints that move it."""
    return _link(number, link, SUBJECTS)


def _constraint(_: int, constraint: dict[str, Any]) -> str:
    return f"  {constraint['name']}  ({_held(constraint)})"


def _share(_: int, share: dict[str, Any]) -> str:
    return f"  {share['name']}  ({', '.join(share['kinds'])} of {listed(share['links'], SUBJECTS)})"


def _limits(joint: dict[str, Any]) -> str:
    """Return the limits of a joint that the file gives, in words."""
    unit = joint["unit"]
    ends = [joint[what] for what in ("lower", "upper")]
    said = [f"{LESS if e is None else f'{e:g}'}" for e in ends]
    parts = [f"{said[0]} to {said[1]} {unit}"] if ends != [None, None] else []
    units = {"velocity": f"{unit}/s", "effort": "N·m" if unit == "rad" else "N"}
    parts += [f"{joint[what]:g} {of}" for what, of in units.items() if joint[what] is not None]
    return f"  ({', '.join(parts)})" if parts else ""


def _held(constraint: dict[str, Any]) -> str:
    """Return what a constraint holds, in words."""
    if "expression" in constraint:
        return f"of {constraint['kind']}: {constraint['expression']}"
    if constraint["kind"] == "coupling":
        return f"coupling of {', '.join(constraint['terms'])}"
    length = f" of {constraint['length']:g} m" if "length" in constraint else ""
    return f"{constraint['kind']}{length}: {' and '.join(constraint['ends'])}"
