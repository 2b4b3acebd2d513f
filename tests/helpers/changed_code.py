"""A module whose functions do something else, as if its source said so."""

import inspect
from collections.abc import Iterator
from types import FunctionType, ModuleType

import pytest

INNER = ("fget", "func", "__wrapped__")


def change_code(patch: pytest.MonkeyPatch, module: ModuleType, old: str, new: str) -> None:
    """Have each function and method of a module do what it would if `old` were `new` in its source."""
    text = inspect.getsource(module)
    assert old in text
    changed = ModuleType(module.__name__)
    vars(changed).update({"__package__": module.__package__})
    exec(compile(text.replace(old, new), str(module.__file__), "exec"), vars(changed))
    there = dict(_functions(module, module.__name__))
    for name, function in _functions(changed, module.__name__):
        patch.setattr(there[name], "__code__", function.__code__)


def _functions(place: object, module: str) -> Iterator[tuple[str, FunctionType]]:
    for value in vars(place).values():
        if isinstance(value, type) and value.__module__ == module:
            yield from _functions(value, module)
        # Behind a property, a cached property or a cache there is a function too.
        inner = next((getattr(value, name) for name in INNER if hasattr(value, name)), value)
        if isinstance(inner, FunctionType) and inner.__module__ == module and not inner.__closure__:
            yield inner.__qualname__, inner
