"""Reading a robot from a built-in name or a file."""

import re
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TypeAlias

from linkwise import bounded_file
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import is_file, require_file
from linkwise.robot.build import build
from linkwise.robot.builtin.planar import planar
from linkwise.robot.constraints import check_constraints
from linkwise.robot.coordinates import MOST_JOINTS
from linkwise.robot.description import Description
from linkwise.robot.options import Options
from linkwise.robot.parameters import numeric
from linkwise.robot.readers.mjcf.files import mjcf_files
from linkwise.robot.readers.mjcf.reader import read_mjcf
from linkwise.robot.readers.osim import document
from linkwise.robot.readers.osim.reader import read_osim
from linkwise.robot.readers.sdf.reader import read_sdf
from linkwise.robot.readers.toml.constraints import with_constraint_file
from linkwise.robot.readers.toml.reader import read_toml
from linkwise.robot.readers.urdf.reader import read_urdf, root_tag
from linkwise.robot.readers.xml_file import LARGEST, XACRO
from linkwise.robot.robot import Robot

Reader: TypeAlias = Callable[[Path], Description]
XML: dict[str, Reader] = {"mujoco": read_mjcf, "sdf": read_sdf}
"""Readers of XML files by root element; any other element is read as URDF."""


def read_xml(path: Path) -> Description:
    """Read MJCF or SDFormat where the root element says so, else URDF."""
    return XML.get(root_tag(path), read_urdf)(path)


READERS: dict[str, Reader] = {
    ".toml": read_toml,
    ".urdf": read_urdf,
    ".sdf": read_sdf,
    ".xml": read_xml,
    ".mjcf": read_mjcf,
    ".osim": read_osim,
}
"""Readers of files, by the end of the file's name."""

MOST_BYTES = {".toml": bounded_file.LARGEST, ".osim": document.LARGEST}
"""Largest size in bytes, by the end of the name, of files with a limit other than that of most XML."""

FILES = ("puma560", "torso")
"""Built-in robots that are TOML files beside `planar`."""

BUILT_IN = ("planar3", f"planarN (N from 1 to {MOST_JOINTS})", *FILES)
DESCRIPTIONS = f"{', '.join(BUILT_IN)}, or a {', '.join(READERS)} or .py file; .xml is URDF, MJCF or SDFormat"
"""All sources that a robot may be read from, in words."""


def read_robot(spec: str | Path, options: Options | None = None) -> Robot:
    """Return the robot of a built-in name or a file; raises LinkwiseError naming the file and the remedy."""
    options = options or Options()
    if not str(spec).strip():
        raise LinkwiseError(f"the robot's name is empty; give {DESCRIPTIONS}")
    robot = _read_robot(spec, options)
    return replace(robot, request={"robot": told_name(spec), **robot.request})


def told_name(spec: str | Path) -> str:
    """Return the name of a robot in a manifest: its file without the folder, or the built-in name."""
    return Path(spec).name if is_file(Path(spec)) else str(spec)


def _read_robot(spec: str | Path, options: Options) -> Robot:
    with within(str(spec)):
        if match := re.fullmatch(r"planar([1-9][0-9]*)", str(spec)):
            return _built(planar(_joints(match[1])), options)
        if str(spec) in FILES:
            with resources.as_file(resources.files("linkwise.robot.builtin") / f"{spec}.toml") as built_in:
                return _built(read_toml(built_in), options)
        try:
            description = _read_file(Path(spec))
        except OSError as error:
            raise LinkwiseError(f"cannot be read: {error.strerror}") from None
        return _built(description, options)


def reader_of(path: Path) -> Reader | None:
    """Return the reader of a file; None for one that is not a robot's."""
    reader = READERS.get(path.suffix.lower())
    return XML.get(root_tag(path), read_urdf) if reader is read_xml else reader


def most_bytes(path: str | Path) -> int:
    """Return the largest size in bytes of a file that its reader accepts."""
    return MOST_BYTES.get(Path(path).suffix.lower(), LARGEST)


def is_built_in(spec: str | Path) -> bool:
    """Return whether a name is that of a built-in robot."""
    return str(spec) in FILES or re.fullmatch(r"planar([1-9][0-9]*)", str(spec)) is not None


def is_description(spec: str | Path) -> bool:
    """Return whether a name is that of a built-in robot, or ends as a robot's file does."""
    return is_built_in(spec) or Path(spec).suffix.lower() in READERS


def robot_files(spec: str | Path, options: Options) -> tuple[Path, ...]:
    """Return the files that a robot is read from, with those that they include; a built-in robot has none.

    The file of constraints that `options` name is among them. Raises LinkwiseError, which names the file, for
    malformed XML.
    """
    path = Path(spec)
    own: tuple[Path, ...] = () if is_built_in(spec) else (path,)
    with within(str(spec)):
        if own and reader_of(path) is read_mjcf:
            files = mjcf_files(path)
            own = (*files.documents, *files.others)
    return own if options.constraints is None else (*own, Path(options.constraints))


def _built(description: Description, options: Options) -> Robot:
    """Return the robot of a description and of the constraints beside it."""
    if options.constraints is not None:
        check_constraints(numeric(description))
        with within(options.constraints):
            try:
                description = with_constraint_file(description, Path(options.constraints))
            except OSError as error:
                raise LinkwiseError(f"cannot be read: {error.strerror}") from None
            check_constraints(numeric(description))
    return build(description, options)


def _joints(digits: str) -> int:
    if len(digits) > len(str(MOST_JOINTS)) or int(digits) > MOST_JOINTS:
        raise LinkwiseError(
            f"planarN takes N from 1 to {MOST_JOINTS}, as the number of coefficients grows with N³; "
            "choose a smaller N"
        )
    return int(digits)


def _read_file(path: Path) -> Description:
    missing = f"no such file or built-in robot; the built-ins are {', '.join(BUILT_IN)}"
    require_file(path, missing, "the robot's file")
    if path.suffix.lower() == ".xacro":
        raise LinkwiseError(XACRO)
    if path.suffix.lower() == ".py":
        raise LinkwiseError("a Python file holds energies, not a robot; linkwise.read_system reads it")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise LinkwiseError(
            f"unknown kind of file {path.suffix!r}; give {', '.join(READERS)}, or .py for energies"
        )
    return reader(path)
