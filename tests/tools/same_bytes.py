"""Proof that bytes are the same whatever the surroundings: `make same`.

Packages, reports and analyses are made in a process of its own for each change of the surroundings, and with
other Pythons, and compared file by file with those of a plain run.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tools.pythons import NEWER, interpreter

ROOT = Path(__file__).parents[2]
OPTIONAL = ("torch", "mujoco", "scipy", "pyarrow", "matplotlib", "plotly")


@dataclass(frozen=True)
class Surroundings:
    """Differences of a run from a plain one; `mask` is its umask."""

    environment: dict[str, str] = field(default_factory=dict)
    python: tuple[str, ...] = (sys.executable,)
    folder: str = "here"
    missing: tuple[str, ...] = ()
    mask: int = 0o022


PLAIN = Surroundings({"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "TZ": "UTC", "OMP_NUM_THREADS": "1"})
CHANGES = {
    "hash seed": Surroundings({"PYTHONHASHSEED": "4711"}),
    "directory": Surroundings(folder="elsewhere, ä folder's name/deep"),
    "Turkish": Surroundings({"LC_ALL": "tr_TR.UTF-8"}),
    "German, Latin-1": Surroundings({"LC_ALL": "de_DE.ISO-8859-1", "PYTHONUTF8": "0"}),
    "C, ASCII": Surroundings({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}),
    "time zone": Surroundings({"TZ": "Asia/Kathmandu"}),
    "mask": Surroundings(mask=0o077),
    "no extras": Surroundings(missing=OPTIONAL),
    "-O": Surroundings(python=(sys.executable, "-O")),
    "-OO": Surroundings(python=(sys.executable, "-OO")),
    "threads": Surroundings({"OMP_NUM_THREADS": "7", "OPENBLAS_NUM_THREADS": "7"}),
    "SymPy without cache": Surroundings({"SYMPY_USE_CACHE": "no"}),
}
SYSTEMS = ("windows", "macos")
ALL_AT_ONCE = Surroundings(
    {"PYTHONHASHSEED": "4711", "LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu", "OMP_NUM_THREADS": "7"}
    | {"SYMPY_USE_CACHE": "no", "PYTHONUTF8": "0"},
    (sys.executable, "-OO"),
    "elsewhere, ä folder's name/deep",
    ("torch", "mujoco"),
    0o077,
)


def on_another_system(system: str) -> Surroundings:
    """Return surroundings as far as `other_system` makes them, without a compiler, and on a console of few
    letters."""
    python = (sys.executable, str(ROOT / "tests/helpers/other_system.py"), system)
    few = {"PATH": "/nowhere", "PYTHONUTF8": "0", "PYTHONIOENCODING": "cp1252", "LC_ALL": "de_DE.ISO-8859-1"}
    return Surroundings(few, python)


def files(surroundings: Surroundings, place: Path, locales: Path) -> dict[str, bytes]:
    """Return what a run writes, by its path."""
    folder = place / surroundings.folder
    folder.mkdir(parents=True)
    shutil.copy(ROOT / "tests/data/skew.toml", folder)
    shutil.copy(ROOT / "tests/data/cart_pendulum.py", folder / "cart.py")
    _write_log(folder / "log.csv")
    command = [*surroundings.python, str(ROOT / "tests/tools/everything.py"), *surroundings.missing]
    environment = {"PATH": os.environ["PATH"], "HOME": str(place), "LOCPATH": str(locales)}
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment | PLAIN.environment | surroundings.environment,
        umask=surroundings.mask,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr.decode(errors="replace"))
    written = sorted(path for path in (folder / "out").rglob("*") if path.is_file())
    kept = [path for path in written if path.suffix != ".pyc"]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in kept}


def _write_log(path: Path) -> None:
    import tomllib

    joints = [joint["name"] for joint in tomllib.loads((path.parent / "skew.toml").read_text())["joint"]]
    time = np.arange(50) / 100
    rows = [",".join(["time", *joints])]
    values = [[t, *(np.sin(k + 3 * t) for k in range(len(joints)))] for t in time]
    rows += [",".join(repr(float(value)) for value in row) for row in values]
    path.write_text("\n".join(rows) + "\n")


def differing(first: dict[str, bytes], second: dict[str, bytes]) -> list[str]:
    """Files that both runs wrote, with other bytes."""
    return [name for name in first.keys() & second.keys() if first[name] != second[name]]


def make_locales(place: Path) -> Path:
    """Compile the locales that the runs ask for, where their sources are; Python takes C for others."""
    place.mkdir(exist_ok=True)
    if shutil.which("localedef"):
        for name, charset in (("tr_TR", "UTF-8"), ("de_DE", "ISO-8859-1")):
            command = ["localedef", "-i", name, "-f", charset, str(place / f"{name}.{charset}")]
            subprocess.run(command, capture_output=True, check=False)
    return place


def environment(version: str, place: Path) -> str | None:
    """The Python of an environment with linkwise alone; None where this version is not here."""
    base = interpreter(version)
    if base is None:
        return None
    subprocess.run([base, "-m", "venv", str(place / version)], check=True)
    python = str(place / version / "bin/python")
    pins = ["--constraint", str(ROOT / "constraints.txt")]
    subprocess.run([python, "-m", "pip", "install", "--quiet", *pins, "--editable", str(ROOT)], check=True)
    return python


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare every change with the plain run; exit status 1 where bytes differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only", choices=[*CHANGES, *SYSTEMS, *NEWER], action="append", help="may be repeated"
    )
    wanted = parser.parse_args(arguments).only or [*CHANGES, *SYSTEMS, *NEWER]
    different, compared = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        locales = make_locales(place / "locales")
        plain = files(PLAIN, place / "plain", locales)
        print(f"plain: {len(plain)} files")
        for name in wanted:
            surroundings = on_another_system(name) if name in SYSTEMS else CHANGES.get(name)
            if surroundings is None:
                python = environment(name, place)
                if python is None:
                    print(f"{name}: no such Python here, not compared")
                    continue
                surroundings = Surroundings(python=(python,), missing=OPTIONAL)
            other = files(surroundings, place / name, locales)
            bad = differing(plain, other)
            different, compared = different + len(bad), compared + 1
            print(f"{name}: {len(other)} files, {len(bad)} differ {' '.join(bad[:5])}", flush=True)
    print(f"{len(plain)} files in {compared} other surroundings: {different} differ")
    return int(different > 0)


if __name__ == "__main__":
    sys.exit(main())
