"""Record of a bundle: the analysis as it was written, what made it, and its files with their hashes."""

import platform
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from linkwise_runtime.version import VERSION

from linkwise.analysis.choices import AnalysisChoices
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.option import written
from linkwise.package.decode import decode, known_keys, parse_json, require, toml_value
from linkwise.pipeline import is_program
from linkwise.robot import Options
from linkwise.robot.read import is_built_in

FILE = "bundle.zip"
"""Name of the bundle in the folder of a result."""
CONTENTS = "bundle.json"
RESULT = "result"
"""Folder in the bundle with the record and the table."""
SCHEMA = 1

Kind = Literal["built-in", "file", "program", "package"]
LIBRARIES = ("numpy", "scipy", "sympy", "pyarrow", "mujoco", "opensim", "ezc3d", "h5py", "rosbags", "torch")
"""Libraries that have a part in numbers, or read files."""


@dataclass(frozen=True)
class WrittenAnalysis:
    """An analysis as it is written: where log and robot are, and options by key, those given alone.

    `kind` says what the robot is: a program and a package are code. Texts of options that are files are
    paths.
    """

    log: str
    robot: str
    kind: Kind
    backend: str
    choices: Mapping[str, Any]
    options: Mapping[str, Any]

    def with_files(self, named: Mapping[str, str]) -> "WrittenAnalysis":
        """Return the same with other names of log, robot and files; a name without another stays."""

        def of(kind: type, given: Mapping[str, Any]) -> dict[str, Any]:
            files = {one.key for one in written(kind) if one.option.is_file}
            return {key: _named(value, named) if key in files else value for key, value in given.items()}

        return WrittenAnalysis(
            named.get(self.log, self.log),
            named.get(self.robot, self.robot),
            self.kind,
            self.backend,
            of(AnalysisChoices, self.choices),
            of(Options, self.options),
        )

    @property
    def files(self) -> Iterator[str]:
        """Paths of files that options name, in the order of the options."""
        for kind, given in ((AnalysisChoices, self.choices), (Options, self.options)):
            for one in written(kind):
                value = given.get(one.key) if one.option.is_file else None
                yield from value if isinstance(value, list) else filter(None, [value])


def written_analysis(log: Path, robot: Path, backend: str, given: Mapping[str, Any]) -> WrittenAnalysis:
    """Return an analysis as it was written; backend: the one that computed."""
    options = {one: given_of(one, given) for one in (AnalysisChoices, Options)}
    return WrittenAnalysis(
        str(log), str(robot), kind_of(robot), backend, options[AnalysisChoices], options[Options]
    )


def kind_of(robot: Path) -> Kind:
    """Return what a robot is."""
    if robot.is_dir():
        return "package"
    if is_program(robot):
        return "program"
    return "built-in" if is_built_in(robot) and not robot.exists() else "file"


def given_of(kind: type, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a dataclass that were given and are not the usual ones, as plain data."""
    return {
        one.key: _plain(given[one.key])
        for one in written(kind)
        if given.get(one.key) not in (None, [], (), one.default)
    }


def _plain(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def _named(value: Any, named: Mapping[str, str]) -> Any:
    return [named.get(one, one) for one in value] if isinstance(value, list) else named.get(value, value)


@dataclass(frozen=True)
class PackedFile:
    """Size and hash of a file in a bundle."""

    bytes: int
    sha256: str


@dataclass(frozen=True)
class Bundle:
    """Contents of a bundle: the analysis, versions of what made it, files by name, and what was left out."""

    analysis: WrittenAnalysis
    versions: Mapping[str, str]
    files: Mapping[str, PackedFile]
    left_out: tuple[str, ...] = ()

    @property
    def tops(self) -> set[str]:
        """Names of the files, and of folders in which they are, which a log or a robot may be."""
        folders = {str(folder) for name in self.files for folder in PurePosixPath(name).parents}
        return {*self.files, *folders} - {"."}

    def record(self) -> dict[str, Any]:
        """Return this as plain data."""
        return {"schema": SCHEMA, **asdict(self)}

    @staticmethod
    def read(text: str) -> "Bundle":
        """Return the contents of a bundle by its record; raises ValueError for any other text."""
        data = parse_json(text)
        require(isinstance(data, dict) and data.get("schema") == SCHEMA, "schema", str(SCHEMA), data)
        return decode(Bundle, data, "", also=("schema",))

    def require_own(self) -> None:
        """Raise LinkwiseError for files that are not in the bundle, and for unknown options."""
        asked = self.analysis
        for kind, given in ((AnalysisChoices, asked.choices), (Options, asked.options)):
            kinds = {one.key: one.kind for one in written(kind)}
            for key, value in known_keys(f"{CONTENTS}: options", given, kinds).items():
                toml_value(kinds[key], f"{CONTENTS}: {key}", value)
        tops, has_file = self.tops, asked.kind != "built-in"
        for path in (asked.log, *asked.files, *([asked.robot] if has_file else [])):
            if path not in tops:
                raise LinkwiseError(f"names {short(path, 80)!a}, which is not in it; do not trust it")
        if not has_file and not is_built_in(asked.robot):
            raise LinkwiseError(f"its robot {short(asked.robot, 80)!a} is not built in; do not trust it")


def versions_here() -> dict[str, str]:
    """Return the versions of linkwise, Python, the system and the libraries that have a part in numbers."""
    found = {"linkwise": VERSION, "Python": platform.python_version()}
    found["system"] = f"{platform.system()} {platform.machine()}"
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found
