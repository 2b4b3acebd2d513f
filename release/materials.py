"""Bills of materials: what comes with a wheel, in which version and under which licence, as CycloneDX."""

import json
import sys
import venv
from pathlib import Path

from release.command import run


def bill(wheel: Path, project: Path, pins: Path, target: Path, work: Path, epoch: str) -> None:
    """Write the bill of an environment in which the wheel is installed with what it needs, and nothing else.

    wheel: of the project in folder `project`, whose pyproject.toml says what the bill is of
    pins: versions of what it needs, those that the tests ran with
    work: folder for the environment
    """
    environment = work / f"environment of {project.name}"
    venv.create(environment, symlinks=True)
    python = environment / "bin/python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile")
    run(*pip, "--constraint", pins, wheel, folder=environment)
    cyclonedx = (sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible")
    about = ("--pyproject", project / "pyproject.toml", "--mc-type", "library", "--output-file", target)
    run(*cyclonedx, *about, python, folder=environment, SOURCE_DATE_EPOCH=epoch)
    found = json.loads(target.read_text(encoding="utf-8"))
    found["metadata"]["component"]["version"] = wheel.name.split("-")[1]  # pyproject.toml has it as dynamic
    target.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
