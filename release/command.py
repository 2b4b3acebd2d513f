"""A program that is asked, and must not fail."""

import os
import subprocess
from pathlib import Path

from linkwise.errors import LinkwiseError

SAID = 15
"""Last lines of a program that failed, which are shown."""


def run(*command: str | Path, folder: Path, **environment: str) -> str:
    """Return what a command prints.

    Files that it makes are for everyone to read, whoever builds. Raises LinkwiseError with its last lines
    where it fails.
    """
    done = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        umask=0o022,
    )
    if done.returncode:
        last = "\n".join((done.stdout + done.stderr).splitlines()[-SAID:])
        raise LinkwiseError(f"{' '.join(map(str, command))}: exit status {done.returncode}\n{last}")
    return done.stdout
