"""A package that stands alone: with a copy of what it imports of linkwise_runtime, and no more."""

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources

from linkwise.package.own_files import LICENSE
from linkwise.package.runtime_imports import RUNTIME, of_copy


def with_runtime(files: Mapping[str, str]) -> dict[str, str]:
    """Return the files of a package, importing the copies that they get of the runtime's files."""
    asked = {module for path, text in files.items() if path.endswith(".py") for module in _asked(text)}
    copies = {f"{RUNTIME}/{path}": _text(path) for path in sorted({LICENSE, *_closure(asked)})}
    return {path: of_copy(path, text) for path, text in files.items()} | copies


def _asked(text: str) -> Iterator[str]:
    """Yield the modules of the runtime that a package's file imports names from."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{RUNTIME}."):
            yield (node.module or "").removeprefix(f"{RUNTIME}.")


def _closure(modules: set[str]) -> set[str]:
    """Return the files of the runtime that these modules need: theirs, all that they import, and folders'."""
    found: set[str] = {"__init__.py"}
    left = list(modules)
    while left:
        module = left.pop()
        if (path := f"{module.replace('.', '/')}.py") in found:
            continue
        found.add(path)
        folder = module.rpartition(".")[0]
        if folder:
            found.add(f"{folder.replace('.', '/')}/__init__.py")
        source = f"{module.replace('.', '/')}.c"
        if resources.files(RUNTIME).joinpath(source).is_file():
            found.add(source)
        left += _imported(module)
    return found


@cache
def _imported(module: str) -> tuple[str, ...]:
    """Return the modules that one of the runtime imports, anywhere in it.

    All its imports of others are relative.
    """
    found = []
    for node in ast.walk(ast.parse(_text(f"{module.replace('.', '/')}.py"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = module.split(".")[: -node.level]
            place = ".".join([*folder, *filter(None, [node.module])])
            names = [f"{place}.{alias.name}".lstrip(".") for alias in node.names]
            inner = [name for name in names if _is_module(name)]
            found += inner or [place]
    return tuple(found)


def _is_module(name: str) -> bool:
    return resources.files(RUNTIME).joinpath(f"{name.replace('.', '/')}.py").is_file()


def _text(path: str) -> str:
    return resources.files(RUNTIME).joinpath(path).read_text(encoding="utf-8")
