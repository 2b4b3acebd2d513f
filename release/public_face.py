"""The public face, written as JSON and compared with that of an earlier version.

Public is what `linkwise` and the pages in docs/api name, and the flags of commands. griffe reads it from the
sources, without running them, and says which changes break whoever uses it.
"""

import ast
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from griffe import (
    Alias,
    AliasResolutionError,
    Attribute,
    Class,
    Expr,
    ExprAttribute,
    ExprName,
    Function,
    GriffeLoader,
    Module,
    ModulesCollection,
    Object,
    Parameter,
    ParameterKind,
    Parameters,
)
from linkwise.errors import LinkwiseError

from release.command_line import LINE, commands

PACKAGES = ("linkwise", "linkwise_runtime", "generated.planar3")
SINGLE = re.compile(r"^\.\. auto(?:function|class|exception):: ([\w.]+)$", re.MULTILINE)
SEVERAL = re.compile(r"^\.\. automodule:: ([\w.]+)\n   :members: (.+)$", re.MULTILINE)
REQUIRED = "REQUIRED"
"""Default of an option that has none."""


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
    program = added(face, Module("commands"))
    for command in commands():
        added(program, command)
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
    constants = found.modules_collection
    if isinstance(found, Function):
        parameters = (signed(parameter, constants) for parameter in found.parameters)
        return function(name, parameters, text(found.returns))
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
        added(made, function("__init__", (filling(field, constants) for field in fields)))
    return made


def function(name: str, parameters: Iterable[Parameter], returns: str | None = None) -> Function:
    """Return a function of these parameters."""
    return Function(name, parameters=Parameters(*parameters), returns=returns, lineno=LINE)


def filling(field: Attribute, constants: ModulesCollection) -> Parameter:
    """Return the parameter that fills a field of a named tuple."""
    kind, default = ParameterKind.positional_or_keyword, valued(field.value, constants)
    return Parameter(field.name, annotation=text(field.annotation), kind=kind, default=default)


def signed(parameter: Parameter, constants: ModulesCollection) -> Parameter:
    """Return a parameter whose default is what is declared by `option`, if it is, without words of help."""
    default = valued(parameter.default, constants)
    if default is not None and default.startswith("option("):
        call = ast.parse(default, mode="eval").body
        assert isinstance(call, ast.Call)
        default = ast.unparse(call.args[0])
    default = None if default == REQUIRED else default
    return Parameter(
        parameter.name, annotation=text(parameter.annotation), kind=parameter.kind, default=default
    )


def valued(expression: str | Expr | None, constants: ModulesCollection) -> str | None:
    """Return an expression as it is written, but with values for names of constants of the modules."""
    if not isinstance(expression, Expr):
        return expression
    if isinstance(expression, ExprName | ExprAttribute) and str(expression) != REQUIRED:
        found = constant(expression.canonical_path, constants)
        if found is not None:
            return valued(found.value, constants)
    if isinstance(expression, ExprName | ExprAttribute):
        return str(expression)
    return "".join(valued(part, constants) or "" for part in expression.iterate(flat=False))


def constant(path: str, constants: ModulesCollection) -> Attribute | None:
    """Return what is set at the top of a module, by its path, if that is there and read."""
    try:
        named = constants[path]
        found = named.final_target if isinstance(named, Alias) else named
    except (AliasResolutionError, KeyError):
        return None
    if isinstance(found, Attribute) and isinstance(found.parent, Module) and found.value is not None:
        return found
    return None


def text(expression: object) -> str | None:
    """Return an expression as it is written."""
    return None if expression is None else str(expression)


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


def read(face: str) -> Module:
    """Return the face that is written so."""
    return Module.from_json(face)
