"""A package of a robot's file, for users who have none yet: made once, and kept in the user's cache.

It is made again when the file changes or one that it includes, or linkwise itself.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.native.cache import ELSEWHERE, cache_directory, locked

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.generator_fingerprint import generator_files
from linkwise.package.load import import_package
from linkwise.package.manifest import FILE, is_too_large
from linkwise.package.write import write_package
from linkwise.pipeline import plan, read_system
from linkwise.progress import Progress, silent
from linkwise.robot import Options, is_description, robot_files
from linkwise.robot.notes import effects

USUAL = ("numpy", "native")
"""Back ends that an analysis asks for by default."""
WARNINGS = "warnings.json"


@dataclass(frozen=True)
class KeptPackage:
    """A package, and warnings of what affects the torques of the robot that it was made of.

    It may stand wherever the path of a package may: `analyze(log, kept_package(file))`.
    """

    directory: Path
    warnings: tuple[str, ...] = ()

    def __fspath__(self) -> str:
        return str(self.directory)

    def load(self, *args: Any, **options: Any) -> Dynamics:
        """Return the robot on a back end, as the package's own `load` does with these arguments.

        Raises LinkwiseError for a damaged manifest, ImportError for files that differ from those it lists.
        """
        robot: Dynamics = import_package(self.directory).load(*args, **options)
        return robot


def kept_package(
    robot: str | Path,
    backend: str | None = None,
    options: Options | None = None,
    progress: Progress = silent,
) -> KeptPackage:
    """Return the package itself where `robot` is a directory; else that of a robot's file or built-in robot.

    It is made for `backend`, or for those of analyses if not given. Raises LinkwiseError for a file that
    cannot be read or generated, for options of a package, and for a cache that cannot be written.
    """
    options = options or Options()
    if Path(robot).is_dir() or not (is_description(robot) or Path(robot).is_file()):
        if options.given:
            flags = listed(f"--{name.replace('_', '-')}" for name in options.given)
            raise LinkwiseError(
                f"{robot} is read already: leave {flags} out, or generate it anew with"
                " them, or name the robot's own file"
            )
        return KeptPackage(Path(robot))
    backends = USUAL if backend is None else (backend,)
    try:
        kept = _all_kept()
        with locked(kept / ".lock", lambda _: None):
            folder = kept / _key(robot, backends, options)
            return _kept(robot, folder, backends, options, progress)
    except (RuntimeError, OSError) as error:
        raise LinkwiseError(f"{robot}: no package of it can be kept: {error}") from error


def _all_kept() -> Path:
    """Return the folder of all packages, made if need be; raises RuntimeError where it cannot be."""
    kept = cache_directory() / "packages"
    try:
        kept.mkdir(exist_ok=True)
    except OSError as error:
        raise RuntimeError(f"cannot make {kept}: {error.strerror}; {ELSEWHERE}") from error
    return kept


def _kept(
    robot: str | Path, folder: Path, backends: Sequence[str], options: Options, progress: Progress
) -> KeptPackage:
    found = next(folder.glob(f"*/{FILE}"), None)
    if found is None or not (folder / WARNINGS).is_file():
        system = read_system(robot, options)
        made = plan(system, backends)
        package = folder / made.name
        write_package(made.files(progress), package)
        text = json.dumps(effects(system.notes))
        (folder / WARNINGS).write_text(text, encoding="utf-8")
        found = package / FILE
    warnings = json.loads((folder / WARNINGS).read_text(encoding="utf-8"))
    return KeptPackage(found.parent, tuple(f"{robot}: {warning}" for warning in warnings))


def _key(robot: str | Path, backends: Sequence[str], options: Options) -> str:
    """Return the hash of all that the package depends on."""
    return hashlib.sha256("\0".join(_parts(robot, backends, options)).encode()).hexdigest()[:32]


def _parts(robot: str | Path, backends: Sequence[str], options: Options) -> Iterator[str]:
    yield from (Path(robot).name, *backends, repr(options))
    for path in robot_files(robot, options):
        if path.is_file():
            # A file too large for a package is left to its reader to refuse, at once.
            yield _size_time(path) if is_too_large(path) else hashlib.sha256(path.read_bytes()).hexdigest()
    yield from map(_size_time, map(Path, generator_files()))


def _size_time(path: Path) -> str:
    """Return a text that changes when a file does, without reading it."""
    found = path.stat()
    return f"{path} {found.st_size} {found.st_mtime_ns}"
