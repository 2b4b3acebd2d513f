"""Import of a generated package from its sources alone: what runs is what its manifest lists."""

import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder, SourceLoader
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

from linkwise_runtime.version import VERSION

from linkwise.package.contents import link_on_the_way
from linkwise.package.emitted_text import Source, foreign_text
from linkwise.package.entries import RuntimeEntry
from linkwise.package.manifest import FILE, Manifest, is_too_large
from linkwise.package.runtime_imports import of_library


def import_listed(directory: Path, manifest: Manifest) -> ModuleType:
    """Import a package by its listed files, under a name of its own; nothing is put on sys.path.

    Neither `__pycache__` nor anything else that is not listed is read. Raises ImportError for a file that
    differs from its SHA-256 or says what linkwise doesn't write, and passes on whatever the package raises.
    """
    path = Path(os.path.realpath(directory))
    # A hash of place and content, so that a package generated anew is imported anew.
    digest = hashlib.sha256(str(path).encode() + (path / FILE).read_bytes()).hexdigest()[:16]
    name = f"_linkwise_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    finder = _Listed(name, path, manifest)
    sys.meta_path.insert(0, finder)
    try:
        return importlib.import_module(name)
    except BaseException:
        sys.meta_path.remove(finder)
        raise


@dataclass(frozen=True, eq=False)
class _Listed(MetaPathFinder):
    """Finder of the modules of one package."""

    name: str
    directory: Path
    manifest: Manifest

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module of the package; None for a module of any other."""
        package, *inner = fullname.split(".")
        if package != self.name:
            return None
        for parts in ([*inner, "__init__.py"], [*inner[:-1], f"{inner[-1]}.py"] if inner else []):
            if (file := "/".join(parts)) in self.manifest.files:
                # No folder is searched, as there could be caches and libraries in it.
                search: list[str] | None = [] if parts[-1] == "__init__.py" else None
                loader = _Verified(self.directory, file, self.manifest)
                return importlib.util.spec_from_file_location(
                    fullname, self.directory / file, loader=loader, submodule_search_locations=search
                )
        return None


@dataclass(frozen=True)
class _Verified(SourceLoader):
    """Loader that compiles one source, if it is as listed and as linkwise writes.

    Without a time of change Python looks for no cache.
    """

    directory: Path
    file: str
    manifest: Manifest

    def get_filename(self, fullname: str) -> str:
        """Return the path of the source."""
        return str(self.directory / self.file)

    def get_data(self, path: str | bytes) -> bytes:
        """Return the source.

        Raises ImportError if it isn't as listed, or says anything that linkwise does not write.
        """
        told: str | None = "was changed"
        source = self.directory / self.file
        if link_on_the_way(self.directory, self.file) is None and not is_too_large(source):
            data, manifest = source.read_bytes(), self.manifest
            if hashlib.sha256(data).hexdigest() == manifest.files[self.file]:
                told = foreign_text(self.file, data, Source.of(manifest))
                if told is None:
                    # The library stands in for a copy of this very runtime, so that each class exists once.
                    same = manifest.runtime == RuntimeEntry(VERSION, vendored=True)
                    return of_library(self.file, data.decode()).encode() if same else data
        raise ImportError(f"{self.file} {told}", path=str(source))
