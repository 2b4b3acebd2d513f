"""The public face, written as JSON and compared with that of an earlier version.

Public is what `linkwise` and the pages in docs/api name, and the flags of commands. griffe reads it from the
sources, without running them, and says which changes break whoever uses it.
"""

import ast
import json
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from griffe import (
    Alias,
    AliasResolutionError,
    Attribute,
    Class,
    Function,
    GriffeLoader,
    Module,
    Object,
    Parameter,
    ParameterKind,
    Parameters,
)
from linkwise.cli.app import COMMANDS, REPORTS, command_of
from linkwise.errors import LinkwiseError

PACKAGES = ("linkwise", "linkwise_runtime", "generated.planar3")
SINGLE = re.compile(r"^\.\. auto(?:function|class|exception):: ([\w.]+)$", re.MULTILINE)
SEVERAL = re.compile(r"^\.\. automodule:: ([\w.]+)\n   :members: (.+)$", re.MULTILINE)
NAMED = ParameterKind.keyword_only
LINE = 0
"""Line of every name: griffe asks for one, and where a name stands is nothing to its users."""


def public_face(root: Path) -> Module:
    """Return the public names of a checkout, by the path that documentation gives them, and the commands.

    Raises LinkwiseError for a name that is not there.
    """
    loader = GriffeLoader(search_paths=[root / "generator", root], allow_inspection=False)
    for name in PACKAGES:
        loader.load(name)
    face = Module("public")
    exported = loader.modules_collection["linkwise"].exports or ()
    for path in sorted({*(f"linkwise.{name}" for name in exported), *documented(root / "docs/api")}):
        *folders, name = path.split(".")
        place = face
        for folder in folders:
            place = place.members.get(folder) or added(place, Module(folder))  # type: ignore[assignment]
        try:
            added(place, plain(name, loader.modules_collection[path]))
        except (AliasResolutionError, KeyError) as error:
            raise LinkwiseError(f"{path}: is told to be public, and is not there") from error
    commands = added(face, Module("commands"))
    for command in flags():
        added(commands, command)
    return face


def documented(pages: Path) -> Iterator[str]:
    """Yield the paths that the pages of the API document."""
    for page in sorted(pages.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        yield from SINGLE.findall(text)
        for module, names in SEVERAL.findall(text):
            yield from (f"{module}.{name.strip()}" for name in names.split(","))


def added(place: Object, new: Object) -> Object:
    """Return a new member of an object, or the one that it has."""
    if new.name not in place.members:
        place.members[new.name] = new
        new.parent = place  # type: ignore[assignment]
    return place.members[new.name]  # type: ignore[return-value]


def plain(name: str, found: Object | Alias) -> Object:
    """Return a name of its own with what users see of it: signatures, public members, inherited ones too."""
    if isinstance(found, Alias):
        return plain(name, found.final_target)
    if isinstance(found, Function):
        return function(name, map(signed, found.parameters), text(found.returns))
    if not isinstance(found, Class):
        return Attribute(name, annotation=text(getattr(found, "annotation", None)), lineno=LINE)
    made = Class(name, bases=[str(base) for base in found.bases], lineno=LINE)
    members = {key: member for key, member in found.all_members.items() if member.is_public}
    for key, member in sorted(members.items()):
        if member.is_function or member.is_attribute:
            added(made, plain(key, member))
    if "NamedTuple" in map(
        str, found.bases
    ):  # of which griffe makes no `__init__`, as it does of dataclasses
        fields = [each for each in found.members.values() if isinstance(each, Attribute) and each.annotation]
        added(made, function("__init__", map(filling, fields)))
    return made


def function(name: str, parameters: Iterable[Parameter], returns: str | None = None) -> Function:
    """Return a function of these parameters."""
    return Function(name, parameters=Parameters(*parameters), returns=returns, lineno=LINE)


def filling(field: Attribute) -> Parameter:
    """Return the parameter that fills a field of a named tuple."""
    kind = ParameterKind.positional_or_keyword
    return Parameter(field.name, annotation=text(field.annotation), kind=kind, default=text(field.value))


def signed(parameter: Parameter) -> Parameter:
    """Return a parameter whose default is what is declared by `option`, if it is, without words of help."""
    default = None if parameter.default is None else str(parameter.default)
    if default is not None and default.startswith("option("):
        call = ast.parse(default, mode="eval").body
        assert isinstance(call, ast.Call)
        default = ast.unparse(call.args[0])
    default = None if default == "REQUIRED" else default
    return Parameter(
        parameter.name, annotation=text(parameter.annotation), kind=parameter.kind, default=default
    )


def text(expression: object) -> str | None:
    """Return an expression as it is written."""
    return None if expression is None else str(expression)


def flags() -> Iterator[Function]:
    """Yield each command as a function of its arguments and flags."""
    for name in (*COMMANDS, *(f"report_{name}" for name in REPORTS)):
        command = command_of(import_module(f"linkwise.cli.{name}").app)
        parameters = []
        for asked in command.params:
            default = None if asked.required else repr(asked.default)
            is_flag = asked.opts[0].startswith("-")
            for spelling in (*asked.opts, *asked.secondary_opts):
                kind = NAMED if is_flag else ParameterKind.positional_only
                parameters.append(Parameter(spelling, kind=kind, default=default))
        yield function(name, parameters)


def written(face: Module) -> str:
    """Return a face as the JSON that griffe reads, a line for each name, so that changes are lines."""
    return "\n".join(lines(json.loads(face.as_json()), "")) + "\n"


def lines(found: dict[str, Any], ending: str, depth: int = 0, key: str = "") -> Iterator[str]:
    """Yield the lines of an object, its members below it."""
    members = found.pop("members", None)
    body = json.dumps(found, ensure_ascii=False)
    head = " " * depth + key
    if not members:
        yield f"{head}{body}{ending}"
        return
    yield f'{head}{body[:-1]}, "members": {{'
    for count, (name, member) in enumerate(members.items(), 1):
        yield from lines(member, "," * (count < len(members)), depth + 1, f"{json.dumps(name)}: ")
    yield f"{' ' * depth}}}}}{ending}"


def read(path: Path) -> Module:
    """Return the face that a file holds."""
    return Module.from_json(path.read_text(encoding="utf-8"))
