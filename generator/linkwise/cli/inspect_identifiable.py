"""The flag `inspect --identifiable`: what joint torques determine, as a table and as data."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.certainty.feasible_bodies import LARGEST
from linkwise_runtime.certainty.identifiability import Identifiability
from linkwise_runtime.certainty.share_bounds import ShareBounds
from linkwise_runtime.dynamics import Dynamics

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import printable
from linkwise.extras import extra
from linkwise.option import option
from linkwise.package.load import open_package
from linkwise.package_cache import kept_package
from linkwise.progress import Progress
from linkwise.robot import Options

MOST = 40
"""Most shares whose intervals are found without --details: joints from the first on, as far as they go."""
USUAL = 0.5, 1.0, 1.0
"""Position in rad or m, within limits, velocity and acceleration of joints that --at leaves out."""
FURTHER = 0.3
"""Distance in rad or m of independent joints from where ties were found to close."""


@dataclass(frozen=True)
class Identifying:
    """Choice of what is told of shares that joint torques do not determine.

    Raises LinkwiseError for choices without `identifiable`.
    """

    identifiable: bool = option(
        False, "Show which shares follow from joint torques, and between what bounds the others lie"
    )
    at: tuple[str, ...] = option(
        (),
        "State of a joint for intervals, 0.5,1,1 if not given; may be repeated",
        metavar="JOINT=POSITION[,VELOCITY[,ACCELERATION]]",
    )
    measured: tuple[str, ...] = option(
        (),
        "Joint whose torque is measured; may be repeated; all that are driven if not given",
        metavar="JOINT",
    )
    mass_limit: tuple[str, ...] = option(
        (),
        "Masses within 0.1 of the file's, of all links or of one, or from 1 to 2 kg; may be repeated",
        metavar="PART|LINK=PART|LINK=KG,KG",
    )

    def __post_init__(self) -> None:
        if not self.identifiable and (self.at or self.measured or self.mass_limit):
            raise LinkwiseError("--at, --measured and --mass-limit go with --identifiable; add it")

    @property
    def masses(self) -> Any:
        """Limits of masses, as `Dynamics.share_bounds` takes them; raise LinkwiseError for another form."""
        whole = [text for text in self.mass_limit if "=" not in text]
        if whole and len(self.mass_limit) > 1:
            raise LinkwiseError(f"--mass-limit {whole[0]} is of all links: give it alone, or name each link")
        if whole:
            return _numbers("--mass-limit", whole[0], whole[0], 1)[0]
        found: dict[str, Any] = {}
        for text in self.mass_limit:
            link, _, numbers = text.rpartition("=")
            pair = _numbers("--mass-limit", text, numbers, 2)
            found[link] = pair[0] if len(pair) == 1 else tuple(pair)
        return found or None


def identified(
    robot: str, options: Options, asked: Identifying, details: bool, progress: Progress
) -> dict[str, Any]:
    """Return what torques determine of a robot, and intervals of the other tau_ij, ready for JSON.

    Raises LinkwiseError for a robot of energies, and for joints, links and limits that are not possible.
    """
    masses = asked.masses
    for library in ("clarabel", "scipy"):
        extra(library)
    directory = kept_package(robot, "numpy", options, progress).directory
    model: Dynamics = open_package(directory).load("numpy")
    measured = asked.measured or None
    try:
        found = model.identifiability(measured)
        motion = _motion(model, found, asked.at)
        joints = found.joints if details else _first(found)
        bounds = model.share_bounds(*motion, masses=masses, measured=measured, joints=joints)
    except LinkwiseError:
        raise
    except (TypeError, ValueError) as error:
        with within(robot):
            raise LinkwiseError(_flagged(str(error))) from error
    return _data(model, found, bounds, motion, joints)


def _flagged(message: str) -> str:
    """Return a message with flags in place of the arguments of Python."""
    for argument, flag in (("masses", "--mass-limit"), ("measured", "--measured")):
        message = message.replace(f"`{argument}`", flag)
        if message.startswith((f"{argument} ", f"{argument}[")):
            message = flag + message.removeprefix(argument)
    return message


def _numbers(flag: str, text: str, numbers: str, most: int) -> list[float]:
    try:
        found = [float(number) for number in numbers.split(",")]
    except ValueError:
        found = []
    if not 1 <= len(found) <= most:
        count = "a number" if most == 1 else f"1 to {most} numbers"
        raise LinkwiseError(f"{flag} {text}: give {count}, with commas between them")
    return found


def _first(found: Identifiability) -> tuple[str, ...]:
    """Return the joints from the first on whose shares are looked at without --details."""
    there, follows = found.shares["torque"]
    counts = np.cumsum((there & ~follows).sum(1))
    return found.joints[: max(1, int((counts <= MOST).sum()))]


def _motion(model: Dynamics, found: Identifiability, given: Sequence[str]) -> tuple[Array, Array, Array]:
    """Return q, qd and qdd (n,) of the state that is looked at; where joints are tied, one that closes."""
    stated: dict[int, list[float]] = {}
    for text in given:
        joint, sign, numbers = text.rpartition("=")
        if not sign:
            raise LinkwiseError(f"--at {text}: write it as JOINT=POSITION,VELOCITY,ACCELERATION")
        at = model.structure.joint_index(joint, f"--at {text}: the joint")
        stated[at] = _numbers("--at", text, numbers, 3)
    own = [model.joint_names.index(name) for name in found.joints]
    if strange := [model.joint_names[k] for k in stated if k not in own]:
        raise LinkwiseError(f"--at {strange[0]}=…: it follows others; give {', '.join(found.joints)}")
    q, qd, qdd = (np.full(model.n, usual) for usual in USUAL)
    q = np.clip(q, model.joint_limits.lower or -np.inf, model.joint_limits.upper or np.inf)
    for k, state in stated.items():
        for whole, number in zip((q, qd, qdd), state, strict=False):
            whole[k] = number
    return (_closed(model, own, q, stated), qd, qdd) if model.backend.ties_joints else (q, qd, qdd)


def _closed(model: Dynamics, own: Sequence[int], q: Array, stated: Mapping[int, Any]) -> Array:
    """Return a position in which ties close; near where they are known to, unless stated."""
    near: Array = model.constraints.closed_position
    if stated:
        wanted = np.where(np.isin(own, list(stated)), q[list(own)], near[list(own)])
        return np.asarray(model.constraints.closed(wanted))
    for distance in (FURTHER, -FURTHER):
        try:
            return np.asarray(model.constraints.closed(near[list(own)] + distance))
        except ValueError:
            continue
    return near


def _data(
    model: Dynamics,
    found: Identifiability,
    bounds: ShareBounds,
    motion: Sequence[Array],
    joints: Sequence[str],
) -> dict[str, Any]:
    """Return all of it, with null in place of what has no end."""
    q, qd, qdd = motion
    own = [model.joint_names.index(name) for name in found.joints]
    return {
        "name": found.name,
        "joints": list(found.joints),
        "links": list(found.links),
        "measured": list(found.measured),
        "base_parameters": found.base_count,
        "parameters": found.parameter_count,
        "by_link": {kind: list(one.counts) for kind, one in found.shares.items()},
        "summed_over_links": {kind: list(one.counts) for kind, one in found.sums.items()},
        "follows": {kind: one.follows.tolist() for kind, one in found.shares.items()},
        "sums_follow": {kind: one.follows.tolist() for kind, one in found.sums.items()},
        "state": [
            {"joint": model.joint_names[k], "unit": model.joint_units[k], "position": float(q[k])}
            | ({"velocity": float(qd[k]), "acceleration": float(qdd[k])} if k in own else {})
            for k in range(model.n)
        ],
        "mass_limits": [_ends(*pair) for pair in bounds.limits.tolist()],
        "tau": list(_intervals(found, bounds, joints)),
        "text": str(found),
    }


def _intervals(
    found: Identifiability, bounds: ShareBounds, joints: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Yield each tau_ij of these joints that is there: its value, its ends, and whether they are proved."""
    there, follows = found.shares["torque"]
    for i, j in np.argwhere(there).tolist():
        if found.joints[i] in joints:
            least, greatest = _ends(bounds.least["torque"][i, j], bounds.greatest["torque"][i, j])
            yield {
                "joint": found.joints[i],
                "link": found.links[j],
                "value": float(bounds.value["torque"][i, j]),
                "follows": bool(follows[i, j]),
                "least": least,
                "greatest": greatest,
                "proved": bool(bounds.proved["torque"][i, j]),
                "held_by_size": bool(bounds.sized["torque"][i, j]),
            }


def _ends(least: float, greatest: float) -> list[float | None]:
    return [float(end) if np.isfinite(end) else None for end in (least, greatest)]


def identified_text(data: Mapping[str, Any]) -> str:
    """Return lines for a person, of `identified`'s data."""
    held = any(low or high is not None for low, high in data["mass_limits"])
    masses = "within --mass-limit" if held else "whatever their masses (--mass-limit)"
    lines = [
        data["text"],
        "",
        f"tau_ij of all bodies that could exist with the same joint torques, {masses},",
    ]
    lines.append(f"at {_state(data['state'])}:")
    width = [
        max(len(word), *(len(printable(row[word])) for row in data["tau"])) for word in ("joint", "link")
    ]
    lines.append(
        f"  {'joint':<{width[0]}}  {'link':<{width[1]}}  {'tau_ij':>10}  {'least':>10}  {'greatest':>10}"
    )
    for row in data["tau"]:
        names = f"  {printable(row['joint']):<{width[0]}}  {printable(row['link']):<{width[1]}}"
        head = f"{names}  {row['value']:>10.4g}"
        ends = f"  {_end(row['least'], '-'):>10}  {_end(row['greatest'], ''):>10}"
        doubt = " *" * row["held_by_size"] + "  (proved less closely)" * (not row["proved"])
        lines.append(f"{head}  follows from torques" if row["follows"] else head + ends + doubt)
    if any(row["held_by_size"] for row in data["tau"]):
        lines.append(f"  * an end goes further with links above {LARGEST:g} times the robot's mass and reach")
    shown = {row["joint"] for row in data["tau"]}
    if rest := len(data["joints"]) - len(shown):
        lines.append(f"  and {rest} more joint{'s' * (rest != 1)}: --details shows all")
    return "\n".join(printable(line) for text in lines for line in text.split("\n"))


def _end(value: float | None, sign: str) -> str:
    return f"{sign}no end" if value is None else f"{value:.4g}"


def _state(state: Sequence[Mapping[str, Any]]) -> str:
    """Return the state in words: at once where it is the same for every joint."""
    moved = [joint for joint in state if "velocity" in joint]
    texts = [
        f"{joint['position']:.4g} {joint['unit']}, {joint['velocity']:g} {joint['unit']}/s, "
        f"{joint['acceleration']:g} {joint['unit']}/s^2"
        for joint in moved
    ]
    if len(set(texts)) == 1:
        return f"{texts[0]} for each joint (--at)"
    return "; ".join(f"{joint['joint']} {text}" for joint, text in zip(moved, texts, strict=True)) + " (--at)"
