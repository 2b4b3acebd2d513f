"""Whether a package is as generated: its files, what Python compiled of them, and its manifest."""

from importlib.resources import files
from pathlib import Path

from linkwise.check.compare import Result, Skipped
from linkwise.package.agreement import disagreements, miscounted
from linkwise.package.bytecode import caches, is_compiled_from_source
from linkwise.package.contents import added, changed
from linkwise.package.load import Package
from linkwise.package.manifest import Manifest, altered_entries
from linkwise.version import VERSION

TOLD = 3
"""Faults that one line tells."""


def check_files(directory: Path, manifest: Manifest) -> list[Result]:
    """Hold every file against its hash, and each compiled module against its source; links are faults."""
    wrong = [] if manifest.files else ["the manifest lists no files"]
    wrong += changed(directory, manifest.files)
    try:
        wrong += [f"{path} was added" for path in added(directory, manifest.files)]
        compiled = caches(directory, manifest.files)
    except OSError as error:
        wrong.append(f"{error.filename} cannot be read ({error.strerror})")
        compiled = []
    for cache in compiled:
        if cache.readable and not is_compiled_from_source(cache):
            place = cache.file.relative_to(directory) if cache.file.is_relative_to(directory) else cache.file
            wrong.append(f"{place} is not {cache.source.name} compiled, delete it")
    results = [_result("hashes", wrong, f"{len(manifest.files)} files as generated")]
    others = sorted({cache.python for cache in compiled if cache.finished and not cache.readable})
    if others:
        results.append(Skipped("__pycache__", f"compiled by {', '.join(others)}: not checked by this Python"))
    return results


def check_manifest(package: Package) -> Result:
    """Hold every entry of the manifest against the package itself, else against its checksum."""
    wrong = [
        *disagreements(package.manifest, package.module),
        *miscounted(package.directory, package.manifest),
        *altered_entries(package.directory),
    ]
    return _result("manifest", wrong, "agrees with the package")


def check_runtime(directory: Path, manifest: Manifest) -> Result:
    """Hold the files that every package has alike against linkwise's own, where this version wrote it."""
    version = manifest.generator.get("linkwise")
    if version != VERSION:
        return Skipped("runtime", f"that of linkwise {version}, which is not at hand to compare with")
    own = {path: _own(path) for path in manifest.files}
    wrong = [
        f"{path} is not that of linkwise {VERSION}"
        for path, text in own.items()
        if text is not None and text != (directory / path).read_bytes()
    ]
    return _result(
        "runtime", wrong, f"{sum(text is not None for text in own.values())} files are linkwise's own"
    )


def _own(path: str) -> bytes | None:
    """The file of linkwise that a package has a copy of at this path; None where that is no copy."""
    folder, _, name = path.rpartition("/")
    places = {"runtime": files("linkwise.runtime"), "c": files("linkwise.runtime").joinpath("c")}
    if folder in places and (file := places[folder].joinpath(name)).is_file():
        return file.read_bytes()
    return None


def _result(name: str, wrong: list[str], right: str) -> Result:
    more = f" and {len(wrong) - TOLD} more" if len(wrong) > TOLD else ""
    return Result(name, not wrong, None, "; ".join(wrong[:TOLD]) + more if wrong else right)
