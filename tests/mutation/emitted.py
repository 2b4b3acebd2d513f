"""Does `linkwise check` alone catch a wrong formula? One change in one emitted file, hashes made to fit.

python tests/mutation/emitted.py --out out/mutate [--each 40] [--only planar3]

What survives is to be caught by a check, or listed in emitted.json, by its package, with the reason why
nothing that is promised changes.
Verdicts are kept beside those of the other sweep, so that this one goes on where it stopped.
"""

import argparse
import hashlib
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.urdf_text import chain, joint, link, mimic, robot
from linkwise import Options, generate, read_system, write_package
from linkwise.check import results_of
from linkwise.emit.formulas import are_short
from linkwise.generator_fingerprint import fingerprint
from mutation.mutants import Mutant, Rules, mutants
from mutation.rooms import chance

DATA = Path(__file__).parents[1] / "data"
FORMULAS = (
    *("forms/link_*.py", "energies/link_*.py", "names.py"),
    *("c/*.h", "c/*.c", "formulas.txt", "formulas.tex"),
)
BACKENDS = ("numpy", "autograd", "c", "formulas")
SAMPLES = 20
EXPLAINED = Path(__file__).with_name("emitted.json")
RULES = Rules(share=1e-6, names=True)
"""Constants change by a millionth of their own."""
EVERY_JOINT = robot(
    *map(link, "abcdef"),
    joint("slide", "a", "b", type="prismatic", axis="1 -2 0.5"),
    joint("turn", "b", "c", type="continuous", axis="0 0.6 -0.8"),
    joint("follow", "c", "d", type="prismatic", inner=mimic("turn", 0.3, -0.2)),
    joint("echo", "d", "e", inner=mimic("turn", -1.7, 0.4)),
    joint("plane", "c", "f", type="planar", axis="0.2 0.3 0.9"),
)
ROBOTS = {
    "planar3": ("planar3", {}),
    "planar2_symbolic": ("planar2", {"parameters": "symbolic"}),
    "puma560": ("puma560", {}),
    "torso": ("torso", {}),
    "skew_symbolic": (str(DATA / "skew.toml"), {"parameters": "symbolic"}),
    "every_joint": (chain, {}),
    "turntable": (str(DATA / "turntable.py"), {}),
    "cart_pendulum": (str(DATA / "cart_pendulum.py"), {"parameters": "symbolic"}),
}


def package(name: str, folder: Path) -> Path:
    """Generate one of the packages."""
    spec, options = ROBOTS[name]
    if name == "every_joint":
        spec = folder / "every_joint.urdf"
        spec.write_text(EVERY_JOINT)
    system = read_system(spec, Options(**options))
    backends = [one for one in BACKENDS if one != "formulas" or are_short(system)]
    write_package(generate(system, backends, name), folder / name)
    return folder / name


def formula_mutants(directory: Path) -> list[Mutant]:
    """All mutants of the emitted formulas of a package."""
    found: list[Mutant] = []
    for pattern in FORMULAS:
        for path in sorted(directory.glob(pattern)):
            text = path.read_text()
            every = mutants(path.relative_to(directory).as_posix(), text, RULES)
            found += (mutant for mutant in every if not _prose(mutant, text[: mutant.start]))
    return found


def _prose(mutant: Mutant, before: str) -> bool:
    """Return whether it changes no result: a head, when results pass the cache by, 0 · W, · W where W is 1.

    before: the file up to there
    """
    text = mutant.text
    nothing = mutant.old == "*" and ("_one(" in text or before.endswith("[0 "))
    if nothing or text.startswith("const int large ="):
        return True
    if mutant.path.startswith("formulas"):
        return not text.startswith(("tau_", r"\["))
    return text.startswith(("import", "from", "LINK =", "raise"))


def caught(directory: Path, mutant: Mutant | None, seconds: int = 120) -> bool:
    """Return whether `check` refuses the package with this change, in a process of its own.

    It ends at the first result that says so. What takes more `seconds` of the processor, or ten times as
    long, is caught too. The parent may compute nothing with torch: what it has forked could not.
    """
    with tempfile.TemporaryDirectory() as folder:
        changed = Path(folder) / directory.name
        shutil.copytree(directory, changed, ignore=shutil.ignore_patterns("__pycache__"))
        if mutant:
            damage(changed, mutant)
        child = os.fork()
        if child == 0:
            os.setpgid(0, 0)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            signal.alarm(10 * seconds)
            with open(os.devnull, "w") as silence:
                os.dup2(silence.fileno(), 1)
                os.dup2(silence.fileno(), 2)
            try:
                passed = not any(result.failed for result in results_of(changed, SAMPLES))
            except BaseException:
                passed = False
            os._exit(0 if passed else 1)
        status = os.waitpid(child, 0)[1]
        with suppress(ProcessLookupError):  # what it began: after the first failure nobody waits for that
            os.killpg(child, signal.SIGKILL)
        return status != 0


def damage(directory: Path, mutant: Mutant) -> None:
    """Apply a mutant to a package, and write the manifest's hash anew, so that only numbers can tell."""
    file, manifest = directory / mutant.path, directory / "manifest.json"
    file.write_text(mutant.applied(file.read_text()))
    data = json.loads(manifest.read_text())
    data["files"][mutant.path] = hashlib.sha256(file.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(data))


def sample(found: Mapping[str, Mutant], count: int, seed: int = 0) -> dict[str, Mutant]:
    """Some of the mutants: as many of each file as of any other, drawn by a hash, as in the other sweep."""
    by_file: dict[str, list[str]] = {}
    for key, mutant in found.items():
        by_file.setdefault(mutant.path, []).append(key)
    for group in by_file.values():
        group.sort(key=lambda key: chance(f"{seed} {found[key].key}"))
    rounds = [keys[k] for k in range(len(found)) for keys in by_file.values() if k < len(keys)]
    return {key: found[key] for key in rounds[:count]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/mutate"))
    parser.add_argument("--each", type=int, default=60, help="mutants of each package")
    parser.add_argument("--only", nargs="*", default=list(ROBOTS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    import torch.func  # noqa: F401  # loaded once, for all processes that are forked from this one

    options.out.mkdir(parents=True, exist_ok=True)
    file, counts = options.out / "emitted.json", Counter[str]()
    reasons = json.loads(EXPLAINED.read_text())
    kept = json.loads(file.read_text()) if file.is_file() else {}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        os.environ["LINKWISE_CACHE"] = folder
        for name in options.only:
            directory = package(name, Path(folder))
            state = _state(directory)
            found = {f"{name}/{mutant.key}": mutant for mutant in formula_mutants(directory)}
            drawn = sample(found, options.each, options.seed)
            gone = [key for key in reasons if key.startswith(f"{name}/") and key not in found]
            asked = {key: mutant for key, mutant in drawn.items() if key not in reasons}
            new = {key: mutant for key, mutant in asked.items() if kept.get(key, [""])[0] != state}
            if new and caught(directory, None):
                sys.exit(f"{name}: `linkwise check` refuses the package as it was generated")
            for key, verdict in zip(new, pool.map(partial(caught, directory), new.values()), strict=True):
                kept[key] = state, verdict
                file.write_text(json.dumps(kept, indent=1))
            left = [key for key in asked if not kept[key][1]]
            for told, keys in (("survives", left), ("explained, and no such text any more", gone)):
                print(*(f"{told}: {key}\n" for key in keys), sep="", end="")
            own = {
                "gone": len(gone),
                "caught": len(asked) - len(left),
                "survive": len(left),
                "explained": len(drawn) - len(asked),
            }
            print(f"{name}: {_told(own)}", flush=True)
            counts.update(own)
    print(f"{len(options.only)} packages: {_told(counts)}")
    sys.exit(counts["survive"] + counts["gone"] > 0)


def _told(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{counts[what]} {what}" for what in ("caught", "survive", "explained"))


def _state(directory: Path) -> str:
    """Hash of linkwise and of the package: a verdict counts for as long as both are the same."""
    return hashlib.sha256((fingerprint() + (directory / "manifest.json").read_text()).encode()).hexdigest()


if __name__ == "__main__":
    main()
