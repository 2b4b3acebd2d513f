"""One door for every description: a built-in name or a file."""

import re
from importlib import resources
from pathlib import Path

from linkwise.errors import LinkwiseError, within
from linkwise.model.assemble import Options, assemble
from linkwise.model.description import Description
from linkwise.model.mjcf_reader import read_mjcf
from linkwise.model.planar import planar
from linkwise.model.robot import Robot
from linkwise.model.toml_reader import read_toml
from linkwise.model.urdf_reader import read_urdf, root_tag


def read_xml(path: Path) -> Description:
    """Read MJCF where the root element says so, else URDF."""
    return read_mjcf(path) if root_tag(path) == "mujoco" else read_urdf(path)


BUILT_IN = ("planar3", "planarN (any N from 1)", "puma560")
READERS = {".toml": read_toml, ".urdf": read_urdf, ".xml": read_xml, ".mjcf": read_mjcf}
MAX_PLANAR = 200


def read_robot(spec: str | Path, options: Options | None = None) -> Robot:
    """Robot from a built-in name or a file; raises LinkwiseError naming the file and the mend."""
    options = options or Options()
    with within(str(spec)):
        if match := re.fullmatch(r"planar([1-9]\d{0,2})", str(spec)):
            if int(match[1]) > MAX_PLANAR:
                raise LinkwiseError(f"at most {MAX_PLANAR} joints; choose a smaller N")
            return assemble(planar(int(match[1])), options)
        path = Path(spec)
        if str(spec) == "puma560":
            with resources.as_file(resources.files("linkwise.model.robots") / "puma560.toml") as built_in:
                return assemble(read_toml(built_in), options)
        if not path.is_file():
            raise LinkwiseError(f"no such file or built-in robot; the built-ins are {', '.join(BUILT_IN)}")
        reader = READERS.get(path.suffix.lower())
        if reader is None:
            raise LinkwiseError(f"unknown kind of file {path.suffix!r}; give {', '.join(READERS)} or .py")
        return assemble(reader(path), options)
