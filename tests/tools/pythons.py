"""Run the tests with the other Pythons that are here: `make pythons`.

Each has an environment of its own in out/pythons, with what constraints.txt pins, and runs the tests there.
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


def environment(version: str, place: Path, extras: str = "") -> str | None:
    """The Python of an environment with linkwise and these extras; None where this version is not here."""
    base = interpreter(version)
    if base is None:
        return None
    subprocess.run([base, "-m", "venv", str(place / version)], check=True)
    python = str(place / version / "bin/python")
    wanted = f"{ROOT}[{extras}]" if extras else str(ROOT)
    pins = ["--constraint", str(ROOT / "constraints.txt")]
    subprocess.run([python, "-m", "pip", "install", "--quiet", *pins, "--editable", wanted], check=True)
    return python


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status 1 where a test fails, and where no Python of those asked for is here."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=NEWER, action="append", help="may be repeated")
    parser.add_argument("--extras", default="all,test")
    parser.add_argument("tests", nargs="*", help="words for pytest")
    wanted = parser.parse_args(arguments)
    endings = {}
    for version in wanted.only or NEWER:
        python = environment(version, ROOT / "out/pythons", wanted.extras)
        if python is None:
            print(f"{version}: no such Python here, not run")
            continue
        print(f"{version}:", flush=True)
        run = [python, "-m", "pytest", "--numprocesses", "2", "--dist", "loadfile", "-rs", *wanted.tests]
        endings[version] = subprocess.run(run, cwd=ROOT, check=False).returncode
    print(
        *(f"{version}: {'failed' if status else 'passed'}" for version, status in endings.items()), sep="\n"
    )
    return int(not endings or any(endings.values()))


if __name__ == "__main__":
    sys.exit(main())
