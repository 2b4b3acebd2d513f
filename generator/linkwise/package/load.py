"""Import of a generated package from its directory."""

import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def import_package(directory: Path) -> ModuleType:
    """Import a package from its directory, under a name of its own; nothing is put on sys.path."""
    path = directory.resolve()
    digest = hashlib.sha256(str(path).encode() + (path / "manifest.json").read_bytes()).hexdigest()[:16]
    name = f"_linkwise_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(
        name, path / "__init__.py", submodule_search_locations=[str(path)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
