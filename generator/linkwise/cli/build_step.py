"""Requests of build tools to `generate`: a depfile, a stamp, and whether packages are up to date."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from linkwise.cli import counted, tell
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.input_file import is_inside, is_same
from linkwise.option import flag_of, option
from linkwise.output import write_files
from linkwise.package.write import differences, refuse_inside_package
from linkwise.robot import Options, robot_files


@dataclass(frozen=True)
class BuildStep:
    """Requests of a build tool beside the packages, or in their place."""

    PANEL = "For build tools"
    list_outputs: bool = option(False, "Print the paths that would be written; write none")
    check: bool = option(
        False, "Say which files differ from what would be written; write none; exit status 1 if any does"
    )
    depfile: Path | None = option(None, "File that gets, as a rule of make, what the packages depend on")
    stamp: Path | None = option(
        None,
        "Empty file that is made anew at the end: the target of --depfile's rule, by default the "
        "manifests, which keep their time where nothing differs",
    )

    @property
    def writes(self) -> bool:
        """True if packages are written."""
        return not (self.list_outputs or self.check)

    def check_flags(self) -> None:
        """Raise LinkwiseError for a flag that writes nothing together with another one."""
        given = [flag_of(name) for name, value in vars(self).items() if value]
        if len(given) > 1 and not self.writes:
            raise LinkwiseError(f"{given[0]} writes nothing and stands alone; leave {given[1]} out")

    def check_places(self, robot: str, package: Path, options: Options) -> None:
        """Raise LinkwiseError for a depfile or a stamp in the place of an input or inside a package."""
        for place in (self.depfile, self.stamp):
            if place is None:
                continue
            refuse_inside_package(place.parent)
            inputs = any(is_same(place, path) for path in robot_files(robot, options))
            if inputs or place.is_dir() or is_inside(place, package) or is_same(place, package):
                raise LinkwiseError(
                    f"{place} cannot be a depfile or a stamp: {robot} is read from it, or it is a "
                    "folder or in a package; choose another name"
                )

    def finish(self, rule: str) -> None:
        """Write the depfile with its rule, and make the stamp anew.

        The stamp is the last of all: an interrupted build has none, or an older one.
        """
        if self.depfile is not None:
            write_files(self.depfile.parent, {self.depfile.name: rule.encode()})
        if self.stamp is not None:
            self.stamp.parent.mkdir(parents=True, exist_ok=True)
            self.stamp.touch()


def is_stale(files: Mapping[str, str], directory: Path, watched: bool) -> bool:
    """Print how a package on disk differs from its files, and return whether it does.

    watched: whether to print too that it does not
    """
    found = differences(files, directory)
    if not directory.is_dir():
        tell(f"{directory} is not there: {counted(len(files), 'file')}")
    elif found:
        _tell_stale(directory, files, found)
    elif watched:
        tell(f"{directory} is up to date")
    return bool(found)


def _tell_stale(directory: Path, files: Collection[str], found: dict[str, str]) -> None:
    kinds: dict[str, list[str]] = {}
    for path, fault in found.items():
        kinds.setdefault(fault, []).append(path)
    gone = len(found.keys() - set(files))
    more = f", and {gone} that would go" if gone else ""
    tell(f"{directory} is stale: {counted(len(found) - gone, 'file')} of {len(files)}{more}")
    tell(*(f"  {fault}: {listed(paths)}" for fault, paths in kinds.items()))
