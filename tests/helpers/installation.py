"""linkwise as users install it: archives from a clean copy, and environments that lie outside the checkout.

No index is asked: what a package needs is linked from where the tests' own environment has it.
"""

import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
QUIET = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONPATH": "", "PYTHONSAFEPATH": ""}
PIP = (sys.executable, "-m", "pip")
ALONE = ("--quiet", "--no-index", "--no-deps")
"""Without an index, and without what it depends on."""


def run(*command: str | Path, folder: Path, **environment: str) -> str:
    """Return what a command prints; it must not fail."""
    changes = {key: value for key, value in (QUIET | environment).items() if value}
    kept = {key: value for key, value in os.environ.items() if key not in QUIET}
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=kept | changes, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def copied(target: Path) -> Path:
    """The checkout without what git ignores."""
    ignored = (ROOT / ".gitignore").read_text().replace("/", "").split()
    shutil.copytree(ROOT, target, ignore=shutil.ignore_patterns(".git", *ignored))
    return target


def needs_of(requirements: Iterable[str]) -> Iterator[Distribution]:
    """Return what requirements bring where they are installed, themselves included; each once, by name."""
    waiting, seen = [Requirement(text) for text in requirements], set()
    while waiting:
        wanted = waiting.pop(0)
        key = (wanted.name.lower().replace("_", "-"), frozenset(wanted.extras))
        if key in seen:
            continue
        if not any(name == key[0] for name, _ in seen):
            yield distribution(wanted.name)
        seen.add(key)
        for text in distribution(wanted.name).requires or ():
            further = Requirement(text)
            asked = [{"extra": extra} for extra in ("", *wanted.extras)]
            if further.marker is None or any(map(further.marker.evaluate, asked)):
                waiting.append(further)


@dataclass(frozen=True)
class Environment:
    """A virtual environment."""

    folder: Path

    @property
    def programs(self) -> Path:
        """Folder of its programs."""
        return self.folder / "bin"

    @property
    def python(self) -> Path:
        """The environment's Python."""
        return self.programs / "python"

    @property
    def packages(self) -> Path:
        """Folder of its packages."""
        [folder] = self.folder.glob("lib/python*/site-packages")
        return folder

    def install(self, wheel: Path, *options: str) -> None:
        """Install a wheel, or a project with more options, and nothing that it needs."""
        run(*PIP, "--python", self.python, "install", *ALONE, *options, wheel, folder=self.folder)

    def link(self, requirements: Iterable[str]) -> None:
        """Have what requirements bring, linked from the tests' environment, but not linkwise itself."""
        for found in needs_of(requirements):
            if found.name == "linkwise":
                continue
            parts = {
                file.parts[0] for file in found.files or () if file.parts[0] not in ("..", "__pycache__")
            }
            for part in parts:
                if not (self.packages / part).exists():
                    (self.packages / part).symlink_to(found.locate_file(part))

    def run(self, program: str, *arguments: str | Path, folder: Path, **environment: str) -> str:
        """Return what one of its programs prints, in a folder."""
        path = f"{self.programs}{os.pathsep}{os.environ['PATH']}"
        return run(self.programs / program, *arguments, folder=folder, PATH=path, **environment)


def empty_environment(folder: Path) -> Environment:
    """A new environment without any package."""
    venv.create(folder, symlinks=True)
    return Environment(folder)
