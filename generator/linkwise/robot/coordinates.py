"""Which joints become coordinates, which stand still and which follow another."""

from collections import Counter
from dataclasses import dataclass

from linkwise.errors import LinkwiseError
from linkwise.robot.description import Connection, Coupling, Mimic
from linkwise.robot.joint_types import Axis
from linkwise.robot.robot import Coordinate, Note


@dataclass(frozen=True)
class Motion:
    """How an axis moves: ratio · q + offset of a coordinate; without one it stands at the offset."""

    coordinate: int | None
    ratio: float = 1.0
    offset: float = 0.0


def coordinates(
    axes: tuple[Axis, ...],
    connections: tuple[Connection, ...],
    lock: dict[str, float],
    free_mimic: bool,
    notes: list[Note],
) -> tuple[tuple[Coordinate, ...], dict[str, Motion]]:
    """Return the coordinates, and how each axis moves with them, by its name."""
    _check_axes(axes, lock)
    mimics = _mimics(connections, {axis.name for axis in axes}, lock, free_mimic, notes)
    motion: dict[str, Motion] = {}
    moving: list[Coordinate] = []
    for axis in axes:
        if axis.name in lock:
            motion[axis.name] = Motion(None, 0.0, lock[axis.name])
            notes.append(Note("locked", axis.name, f"at {lock[axis.name]:g} {axis.unit}"))
        elif axis.name not in mimics:
            motion[axis.name] = Motion(len(moving))
            moving.append(Coordinate(axis.name, axis.unit))
    for name, mimic in mimics.items():
        master = motion[mimic.master]
        motion[name] = Motion(
            master.coordinate, mimic.ratio * master.ratio, mimic.offset + mimic.ratio * master.offset
        )
        notes.append(Note("mimic", name, _rule(mimic)))
    return tuple(moving), motion


def check_couplings(
    couplings: tuple[Coupling, ...], axes: tuple[Axis, ...], lock: dict[str, float], free: bool
) -> list[Note]:
    """Return a note for each coupled joint that moves freely here; raises LinkwiseError unless `free`."""
    notes = []
    for coupling in couplings:
        joint, master = coupling.joint, coupling.master
        if joint in lock or joint not in {axis.name for axis in axes}:
            continue
        rule = f"coupled to {master!r}" if master else "held"
        if not free:
            raise LinkwiseError(
                f"joint {joint!r} is {rule} by an equality, which the torques would leave out; hold it with "
                f"--lock {joint}=0, or let such joints move by themselves with --free-mimic"
            )
        notes.append(Note("freed", joint, f"{rule} by an equality, which the torques leave out"))
    return notes


def _rule(mimic: Mimic) -> str:
    ratio = {1.0: "", -1.0: "-"}.get(mimic.ratio, f"{mimic.ratio:g} ")
    offset = f" {'-' if mimic.offset < 0 else '+'} {abs(mimic.offset):g}" if mimic.offset else ""
    return f"= {ratio}{mimic.master}{offset}"


def _check_axes(axes: tuple[Axis, ...], lock: dict[str, float]) -> None:
    counts = Counter(axis.name for axis in axes)
    for name, count in counts.items():
        if count > 1:
            raise LinkwiseError(
                f"{count} joints are named {name!r}, one of them made from a joint's type; rename it"
            )
    for name in lock:
        if name not in counts:
            raise LinkwiseError(f"--lock names no moving joint {name!r}; the joints are {', '.join(counts)}")


def _mimics(
    connections: tuple[Connection, ...],
    axes: set[str],
    lock: dict[str, float],
    free: bool,
    notes: list[Note],
) -> dict[str, Mimic]:
    """Joints that follow another one; raises LinkwiseError for those that cannot."""
    mimics: dict[str, Mimic] = {}
    for c in connections:
        if c.mimic is None or c.name in lock:
            continue
        if c.name in axes:
            mimics[c.name] = c.mimic
        elif c.type == "fixed":
            notes.append(Note("ignored", c.name, "the mimic of a fixed joint"))
        else:
            raise LinkwiseError(
                f"joint {c.name!r} is {c.type} and mimics {c.mimic.master!r}; only a joint of one axis can"
            )
    masterless = [name for name, mimic in mimics.items() if mimic.master not in axes]
    if masterless and not free:
        _refuse(masterless, mimics)
    for name in masterless:
        master = mimics.pop(name).master
        notes.append(Note("freed", name, f"mimics {master!r}, which is no moving joint here"))
    for name, mimic in mimics.items():
        if mimic.master in mimics:
            raise LinkwiseError(
                f"joint {name!r} mimics {mimic.master!r}, which is "
                f"{'itself' if mimic.master == name else 'a mimic too'}; name the joint that moves, or hold "
                f"it with --lock {name}=0"
            )
    return mimics


def _refuse(masterless: list[str], mimics: dict[str, Mimic]) -> None:
    name = masterless[0]
    others = f" ({len(masterless)} joints do so)" if len(masterless) > 1 else ""
    raise LinkwiseError(
        f"joint {name!r} mimics {mimics[name].master!r}, which is no moving joint here{others}; hold it with "
        f"--lock {name}=0, or let such joints move by themselves with --free-mimic"
    )
