"""Options for building a robot from what a file describes."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from linkwise.errors import LinkwiseError
from linkwise.option import option

Parameters = Literal["numeric", "nonzero", "symbolic"]


def _names(items: Iterable[str]) -> tuple[str, ...]:
    """Return the lists A,B as they were given, for a joint's name may have a comma.

    Raises LinkwiseError for an empty name.
    """
    given = tuple(item.strip() for item in items)
    if not all(name.strip() for item in given for name in item.split(",")):
        raise LinkwiseError("--independent has an empty name; give joints as A,B")
    return given


def _locks(items: Iterable[str]) -> dict[str, float]:
    """Return the values of the held joints, from JOINT=VALUE; raises LinkwiseError for another form."""
    locked: dict[str, float] = {}
    for item in items:
        joint, _, text = item.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not joint or not math.isfinite(value):
            raise LinkwiseError(f"--lock {item!r} is not of the form JOINT=VALUE, such as --lock elbow=0.5")
        if joint in locked:
            raise LinkwiseError(f"--lock holds {joint!r} twice; give it one value")
        locked[joint] = value
    return locked


@dataclass(frozen=True)
class Options:
    """Options for building a robot from a description; the command line's flags of the same names."""

    PANEL = "Reading the robot"
    """Heading of these options in --help."""
    parameters: Parameters = option(
        "numeric",
        "numeric: their values; symbolic: a symbol for each, set at run time; nonzero: zeros stay "
        "zeros, which keeps formulas short",
    )
    lock: dict[str, float] = option({}, "Hold a joint, rad or m; may be repeated", read=_locks)
    base: Literal["fixed", "floating"] | None = option(
        None,
        "How the root link is held; fixed unless given, but floating where an SDFormat model has no "
        "joint to the world",
    )
    root: str | None = option(None, "Keep only this link and what it carries")
    tip: str | None = option(None, "Keep only the chain of links to this one")
    allow_unphysical: bool = option(False, "Accept bodies that cannot exist")
    free_mimic: bool = option(
        False,
        "Let a mimic joint without a master, or one that MJCF couples, move by itself",
    )
    constraints: str | None = option(
        None,
        "TOML file of constraints: loops and couplings beside those of the robot's own file",
        is_file=True,
    )
    independent: tuple[str, ...] = option(
        (),
        "Joints whose motion gives that of all others under the constraints: A,B; may be repeated, "
        "as for names with a comma; chosen by pivoting unless given",
        read=_names,
    )

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the options that differ from their defaults."""
        usual = Options()
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != getattr(usual, f.name))

    def request(self) -> dict[str, Any]:
        """Return the options as a manifest keeps them: of a file its name and the SHA-256 of its content."""
        told = asdict(self) | {"independent": list(self.independent)}
        if self.constraints is not None:
            path = Path(self.constraints)
            told["constraints"] = {"file": path.name, "sha256": sha256(path.read_bytes()).hexdigest()}
        return told
