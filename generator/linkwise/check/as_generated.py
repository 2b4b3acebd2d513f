"""Checks that a package is as generated: its files, the modules that Python compiled, and its manifest."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from linkwise_runtime.version import VERSION

from linkwise.check.compare import Result, line_of, skipped
from linkwise.emit.backend import backends_of
from linkwise.emit.c.shared_headers import INNER, with_headers
from linkwise.emit.shared_texts import BodyText, init_text, names_text
from linkwise.emit.tree_file import tree_text
from linkwise.emit.vendored_runtime import with_runtime
from linkwise.package.agreement import disagreements, wrong_counts
from linkwise.package.bytecode import caches, is_compiled_from_source
from linkwise.package.contents import changed_files, unlisted_files
from linkwise.package.emitted_text import foreign
from linkwise.package.load import Package, load_package, refuse_exit
from linkwise.package.manifest import Manifest, altered_entries
from linkwise.package.own_files import own_folder
from linkwise.package.runtime_imports import of_copy, of_library

TOLD = 3
"""Number of faults that one line reports."""
MARK = "\0"
BODY = re.compile(
    r"^ {8}ParametricBody\(\n {12}(.*),\n {12}(.*),\n {12}lambda p: \(\n((?: {16}.*,\n)*) {12}\),\n",
    re.MULTILINE,
)
"""Pattern of a body in names.py: its link, parameters and values."""


@dataclass(frozen=True)
class GeneratedFiles:
    """The files of a package, and the manifest that lists them."""

    directory: Path
    manifest: Manifest

    @cached_property
    def package(self) -> Package:
        """The package, imported; passes on whatever it raises."""
        return load_package(self.directory, self.manifest)

    @cached_property
    def compared(self) -> tuple[Result, Result]:
        """Results on the manifest, and on the files that follow from it."""
        return check_manifest(self.package), check_made(self.package)


def check_files(name: str, files: GeneratedFiles) -> list[Result]:
    """Check every file against its hash, and each compiled module against its source.

    Symbolic links are faults.
    """
    directory, manifest = files.directory, files.manifest
    wrong = [] if manifest.files else ["the manifest lists no files"]
    wrong += changed_files(directory, manifest.files)
    try:
        wrong += [f"{path} was added" for path in unlisted_files(directory, manifest.files)]
        compiled = caches(directory, manifest.files)
    except OSError as error:
        wrong.append(f"{error.filename} cannot be read ({error.strerror})")
        compiled = []
    for cache in compiled:
        if cache.readable and not is_compiled_from_source(cache):
            place = cache.file.relative_to(directory) if cache.file.is_relative_to(directory) else cache.file
            wrong.append(f"{place} is not {cache.source.name} compiled, delete it")
    results = [_result(name, wrong, f"{len(manifest.files)} files as generated")]
    others = sorted({cache.python for cache in compiled if cache.finished and not cache.readable})
    if others:
        results.append(skipped("__pycache__", f"compiled by {', '.join(others)}: not checked by this Python"))
    return results


def check_texts(name: str, files: GeneratedFiles) -> list[Result]:
    """Read as text every file that could run: nothing is imported or compiled that linkwise doesn't write."""
    manifest = files.manifest
    wrong, version = foreign(files.directory, manifest), manifest.generator.get("linkwise")
    if not wrong and manifest.runtime.vendored and version != VERSION:
        unread = f"the runtime that it carries is of linkwise {version}, which is not at hand to compare with"
        return [skipped(name, f"{unread}: its code runs as it is")]
    told = "hold arithmetic and calls of the runtime alone, read before they run"
    return [_result(name, wrong, told)]


def check_import(name: str, files: GeneratedFiles) -> Iterator[Result]:
    """Yield a failed result where a package cannot be imported, or not compared with its manifest."""
    try:
        with refuse_exit():
            _ = files.compared
    except Exception as error:
        yield Result(name, False, None, line_of(error))


def check_manifest(package: Package) -> Result:
    """Check every entry of the manifest against the package itself, else against its checksum."""
    wrong = [
        *disagreements(package.manifest, package.module),
        *wrong_counts(package.directory, package.manifest),
        *altered_entries(package.directory),
    ]
    return _result("manifest", wrong, "agrees with the package")


def check_made(package: Package) -> Result:
    """Check the files that follow from the manifest alone, if this version of linkwise wrote the package."""
    version = package.manifest.generator.get("linkwise")
    if version != VERSION:
        unchecked = "__init__.py, names.py, tree.py and what it carries of the runtime were not checked"
        return skipped("made", f"{unchecked}: of linkwise {version}, which is not at hand to compare with")
    wrong = [
        f"{path} is not what linkwise {VERSION} makes of the manifest" for path in _made_otherwise(package)
    ]
    wrong += _added_or_missing(package.directory, package.manifest)
    return _result("made", wrong, "__init__.py, names.py and tree.py are what linkwise makes of the manifest")


def _added_or_missing(directory: Path, manifest: Manifest) -> Iterator[str]:
    """Yield a fault for each file of linkwise's own that a package lacks, or has and does not need."""
    own = {
        path: of_library(path, (directory / path).read_text(encoding="utf-8"))
        for path in manifest.files
        if path.endswith((".py", ".h", ".c")) and own_folder(path) is None
    }
    in_c = {path: text for path, text in own.items() if path.startswith("c/")}
    needed = {*dict(with_headers(in_c.items()))} - own.keys()
    needed |= {*with_runtime(own)} - own.keys() if manifest.runtime.vendored else set()
    there = {path for path in manifest.files if own_folder(path) is not None}
    yield from (f"{path} is missing" for path in sorted(needed - there))
    included = {f"c/{name}" for text in in_c.values() for name in INNER.findall(text)}
    public = {f"c/{manifest.name}.h", f"c/{manifest.name}_index.h"}
    there |= {path for path in in_c if path.endswith(".h")} - public - included
    yield from (f"{path} is needed by nothing" for path in sorted(there - needed))


def _made_otherwise(package: Package) -> Iterator[str]:
    """Yield those of __init__.py, names.py and tree.py that differ from the texts given by the manifest.

    The manifest has neither the docstring's lines on the meaning of parameters, which may be any, nor the
    expressions of bodies and the links with terms that are not quadratic in the velocities, which are checked
    by their values.
    """
    directory, manifest, robot = package.directory, package.manifest, package.module.ROBOT
    chosen = [backend for name, backend in backends_of(manifest.kernel).items() if name in package.backends]
    rigid = manifest.tree is not None

    def written(path: str, text: str) -> str:
        return of_copy(path, text) if manifest.runtime.vendored else text

    init = init_text(manifest.name, chosen, manifest.parameters, [MARK], rigid, manifest.kernel)
    init = written("__init__.py", init)
    head, mark, tail = init.partition(f"    {MARK}\n")
    found = (directory / "__init__.py").read_bytes().decode()
    about = found[len(head) : len(found) - len(tail)]
    if head + about + tail != found or '"""' in about or (about and not mark):
        yield "__init__.py"
    found = (directory / "names.py").read_bytes().decode()
    bodies = [
        BodyText(link, names, tuple(line.strip().removesuffix(",") for line in values.splitlines()))
        for link, names, values in BODY.findall(found)
    ]
    links = {link.name: link.path for link in manifest.links}
    numbers = links, robot.nonquadratic, manifest.parameters, bodies, manifest.passive
    names = names_text(manifest.name, manifest.joints, *numbers, manifest.file_joints, manifest.energies)
    if written("names.py", names) != found:
        yield "names.py"
    if "tree.py" in manifest.files and manifest.tree is not None:
        text = tree_text(manifest.tree, manifest.formulas, list(manifest.parameters))
        if written("tree.py", text) != (directory / "tree.py").read_bytes().decode():
            yield "tree.py"


def _result(name: str, wrong: list[str], right: str) -> Result:
    more = f" and {len(wrong) - TOLD} more" if len(wrong) > TOLD else ""
    return Result(name, not wrong, None, "; ".join(wrong[:TOLD]) + more if wrong else right)
