"""Run `make test ship` with the other Pythons that are here: `make pythons`.

Each has an environment of its own in out/pythons, with what constraints.txt pins.
"""

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
NEWER = ("3.12", "3.13", "3.14")


def interpreter(version: str) -> str | None:
    """A Python of this version in PATH, or of pyenv; None where there is none that starts."""
    found = shutil.which(f"python{version}")
    pyenv = sorted(map(str, Path.home().glob(f".pyenv/versions/{version}.*/bin/python")))
    for candidate in [*([found] if found else []), *pyenv]:
        if not subprocess.run([candidate, "-c", ""], capture_output=True, check=False).returncode:
            return candidate
    return None


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status 1 where a test fails, and where no Python of those asked for is here."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=NEWER, action="append", help="may be repeated")
    wanted = parser.parse_args(arguments)
    endings = {}
    for version in wanted.only or NEWER:
        python = interpreter(version)
        if python is None:
            endings[version] = "not here"
            continue
        told = subprocess.run([python, "--version"], check=True, capture_output=True, text=True).stdout
        print(f"{told.strip()}:", flush=True)
        words = ["make", "--keep-going", f"PYTHON={python}", f"VENV=out/pythons/{version}", "test", "ship"]
        status = subprocess.run(words, cwd=ROOT, check=False).returncode
        endings[version] = "failed" if status else "passed"
    print(*(f"{version} {ending}" for version, ending in endings.items()), sep=", ")
    return int("failed" in endings.values() or "passed" not in endings.values())


if __name__ == "__main__":
    sys.exit(main())
