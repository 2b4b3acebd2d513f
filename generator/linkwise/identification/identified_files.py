"""The record and the page of an identification."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import central

from linkwise.escape import json_text, markdown
from linkwise.identification.base_parameters import NAMES, UNITS
from linkwise.identification.identification_result import Identification
from linkwise.identification.uncertain_robot import FILE, doubt, note, without
from linkwise.package.manifest import Manifest

COEFFICIENTS = {"rad": ("N m s/rad", "N m"), "m": ("N s/m", "N")}
"""Units of viscous and Coulomb friction, by the unit of the joint."""


def identified_files(
    found: Identification, manifest: Manifest, choices: dict[str, Any], lost: Sequence[str]
) -> dict[str, bytes]:
    """Return the record and the page by name.

    choices: settings to record; lost: what the robot's file does not say, in words
    """
    assert manifest.tree is not None
    about = record(found) | {"gravity": list(manifest.tree.gravity), "choices": choices}
    texts = {"identified.json": json_text(about, indent=1) + "\n", "identified.md": page(found, lost)}
    return {name: text.encode() for name, text in texts.items()}


def record(found: Identification) -> dict[str, Any]:
    """Return everything found, as plain data."""
    fit, robot = found.fit, found.robot
    friction = {
        name: {
            "viscous": fit.friction[i, 0],
            "viscous_error": fit.friction_errors[i, 0],
            "coulomb": fit.friction[i, 1],
            "coulomb_error": fit.friction_errors[i, 1],
        }
        for i, name in enumerate((*found.joints, *found.followers))
    }
    joints = {
        name: {
            **friction[name],
            "noise": fit.noise[i],
            **{f"unseen_error_{what}": e[i] for what, e in found.errors(found.unseen).items()},
            **{f"seen_error_{what}": e[i] for what, e in found.errors(found.seen).items()},
        }
        for i, name in enumerate(found.joints)
    }
    own = found.base.combinations @ found.own.reshape(-1)
    base = [
        {"combination": text, "unit": unit, "value": value, "standard_error": error, "package": before}
        for text, unit, value, error, before in zip(
            found.base.texts(), found.base.units, fit.beta, fit.beta_errors, own, strict=True
        )
    ]
    links = {
        link: dict(zip(NAMES, pi.tolist(), strict=True))
        for link, pi in zip(robot.links, found.physical.pi, strict=True)
    }
    return {
        "robot": robot.name,
        "log": found.log.source,
        "rate": found.log.rate,
        "samples_fitted": found.seen.rows,
        "samples_unseen": found.unseen.rows,
        "condition_number": fit.condition,
        "base_parameters": base,
        "joints": joints,
        "joints_that_follow": {name: friction[name] for name in found.followers},
        "friction_counted_in_others": list(found.shared_friction),
        "largest_violation": None if found.log.closed is None else found.log.closed.largest,
        "unmeasured_joints": list(found.unmeasured),
        "joints_without_bearings": list(found.floating),
        "hidden": list(found.base.hidden),
        "links": links,
        "uncertain": without(found) or note(found),
        "leaning_torques": None if found.leaning is None else list(found.leaning),
        "bodies_from_fit_in_standard_errors": found.unbound_distance,
        "warnings": list(found.warnings),
    }


def page(found: Identification, lost: Sequence[str]) -> str:
    """Return the page, in Markdown; `lost` is what the robot's file does not say."""
    return "\n".join(
        [*_head(found), *_joints(found), *_base(found), *_links(found), *_certain(found), *_lost(lost), ""]
    )


def _head(found: Identification) -> Iterator[str]:
    rest = found.unseen.rows
    yield f"# {markdown(found.robot.name)}, identified from {markdown(found.log.source)}"
    yield ""
    yield (
        f"{found.seen.rows:,} samples at {found.log.rate:.6g} Hz were fitted"
        f"{f', the {rest:,} after them were not: they are what *unseen* means' if rest else ''}. "
        f"Condition number of the equations: {found.fit.condition:.3g}, where random motions have "
        f"{found.base.condition:.3g}."
    )


def _joints(found: Identification) -> Iterator[str]:
    yield from ("", "## Torques and friction", "")
    yield (
        "| joint | torque, r.m.s. | error, fitted | error, unseen | by the bodies below | by the package "
        "| viscous | Coulomb | unit of both |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    seen, unseen = found.errors(found.seen), found.errors(found.unseen)
    shown = unseen if found.unseen.rows else seen
    columns = (found.seen.sizes(), seen["fit"], unseen["fit"], shown["bodies"], shown["package"])
    units = [found.robot.units[i] for i in found.bearings.joints]
    for i, (name, unit) in enumerate(zip((*found.joints, *found.followers), units, strict=True)):
        numbers = [f"{column[i]:.3g}" if i < len(found.joints) else "-" for column in columns]
        numbers[2] = numbers[2] if found.unseen.rows else "-"
        rubs = zip(found.fit.friction[i], found.fit.friction_errors[i], strict=True)
        cells = [markdown(name), *numbers, *(f"{f:.4g} ± {e:.1g}" for f, e in rubs)]
        yield f"| {' | '.join([*cells, ', '.join(COEFFICIENTS[unit])])} |"
    yield from _follow(found)
    if found.floating:
        yield ""
        names = ", ".join(map(markdown, found.floating))
        yield f"Without friction, as what floats has no bearings: {names}."
    if found.unmeasured:
        yield ""
        yield f"Not measured, and left out of the fit: {', '.join(map(markdown, found.unmeasured))}."


def _follow(found: Identification) -> Iterator[str]:
    if not found.followers:
        return
    yield ""
    yield (
        f"{', '.join(map(markdown, found.followers))} follow by the constraints and have no torque: what "
        "they take is borne by the others."
    )
    if found.shared_friction:
        names = ", ".join(map(markdown, found.shared_friction))
        yield f"No motion tells the friction of {names} from that of the others, in which it counts."


def _base(found: Identification) -> Iterator[str]:
    yield from ("", f"## Base parameters: the {found.base.count} combinations that torques can tell", "")
    yield "| combination | identified | standard error | package | unit |"
    yield "|---|---|---|---|---|"
    own = found.base.combinations @ found.own.reshape(-1)
    rows = zip(found.base.texts(), found.fit.beta, found.fit.beta_errors, own, found.base.units, strict=True)
    for text, value, error, before, unit in rows:
        yield f"| {markdown(text)} | {value:.5g} | {error:.1g} | {before:.5g} | {unit} |"
    if found.base.hidden:
        yield ""
        yield (
            "Torques of all joints would tell these too, which those measured do not tell by themselves: "
            f"{', '.join(map(markdown, found.base.hidden))}."
        )
    yield ""
    yield (
        f"{', '.join(NAMES)}(link): mass, first moment, and inertia about the origin of the link's frame, "
        f"in its axes; {', '.join(dict.fromkeys(UNITS))}. The frames are those of the package, z on the "
        "joint's axis."
    )


def _links(found: Identification) -> Iterator[str]:
    yield from ("", "## Bodies that can exist and fit", "")
    yield "| link | mass, kg | centre of mass, m | principal moments about it, kg m² | mass in the package |"
    yield "|---|---|---|---|---|"
    for name, pi, own in zip(found.robot.links, found.physical.pi, found.own, strict=True):
        mass, com, inertia = central(pi)
        moments = np.linalg.eigvalsh(inertia)
        places = (", ".join(f"{x:.4g}" for x in values) for values in (com, moments))
        yield f"| {markdown(name)} | {mass:.4g} | {' | '.join(places)} | {own[0]:.4g} |"
    yield ""
    yield (
        "What torques do not tell, such as how a mass is shared between links that move alike, is as near to "
        "the package's own bodies as the rest allows: no mass here is measured unless the table above has it "
        "alone."
    )


def _certain(found: Identification) -> Iterator[str]:
    yield from ("", "## How certain torques by link are", "")
    told = without(found) or f"In {FILE} {note(found)}"
    yield f"{markdown(told[0].upper() + told[1:])}."
    if told := doubt(found):
        yield ""
        yield f"{markdown(told[0].upper() + told[1:])}."
    which = "not clear which" if found.leaning is None else ", ".join(map(markdown, found.leaning))
    yield ""
    yield f"Torques by link that lean on what is not told: {which or 'none'}."


def _lost(lost: Sequence[str]) -> Iterator[str]:
    if lost:
        yield from ("", "## Not in the robot's file", "")
        yield from (f"- {markdown(text[0].upper() + text[1:])}." for text in lost)
