"""Texts that do not depend on how links move: a package's __init__.py and names.py.

They are made only of what a manifest has too, so `linkwise check` makes them again and compares.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from linkwise_runtime.file_joints import FileJoint
from linkwise_runtime.structure import JointLimits, PassiveJoint
from linkwise_runtime.version import VERSION

from linkwise.emit.backend import BackendFiles, Loading
from linkwise.escape import python_docstring, python_literal
from linkwise.package.entries import EnergiesEntry, JointEntry, KernelKind
from linkwise.render import render

LINE = 100


@dataclass(frozen=True)
class BodyText:
    """A link, the parameters that its mass and inertia depend on, and these two as Python expressions."""

    link: str
    parameters: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Maker:
    """A function of the package's __init__.py that makes one back end."""

    name: str
    doc: str
    imports: tuple[str, ...]
    made: str
    module: str
    face: str
    chooses: bool
    learns: bool

    @classmethod
    def of(cls, backend: BackendFiles, loading: Loading, rigid: bool, kernel: KernelKind) -> "Maker":
        """Return the maker of a back end.

        Its class comes from linkwise_runtime, and is the first word of the expression.
        """
        made = loading.made.partition("(")[0]
        imports = [*loading.imports]
        if loading.uses_forms and kernel == "straight":
            imports.append("from .forms import LINKS")
        imports.append(f"from linkwise_runtime.{loading.module} import {made}")
        if loading.uses_rule:
            imports.append("from .tree import RULE" if rigid else "RULE = None")
        if loading.uses_forms and kernel == "loops":
            imports.append("LINKS = None")
        answered = loading.made, loading.module, loading.face
        return cls(backend.name, backend.doc, tuple(imports), *answered, loading.chooses, loading.learns)


def init_text(
    package: str,
    chosen: Iterable[BackendFiles],
    parameters: Iterable[str],
    about: Sequence[str],
    rigid: bool,
    kernel: KernelKind,
) -> str:
    """Return __init__.py, whose `load` makes the back ends of those `chosen`.

    about: lines on the parameters; rigid: whether the links are rigid bodies; kernel: the package's
    """
    loadable = {backend: backend.loading for backend in chosen if backend.loading}
    if not loadable:
        return render("package/face.py.j2", {"version": VERSION})
    fastest_first = sorted(loadable.items(), key=lambda item: item[1].speed)
    makers = [Maker.of(backend, loading, rigid, kernel) for backend, loading in loadable.items()]
    refused = {
        "refuse_choice": any(not maker.chooses for maker in makers),
        "refuse_learning": any(not maker.learns for maker in makers),
    }
    view = {
        "version": VERSION,
        "package": package,
        "default": next(backend.name for backend in loadable),
        "refusals": [name for name, is_needed in refused.items() if is_needed],
        "makers": makers,
        "own_faces": [maker for maker in makers if maker.face != "Dynamics"],
        "choosing": [backend.name for backend, loading in loadable.items() if loading.chooses],
        "learning": [backend.name for backend, loading in loadable.items() if loading.learns],
        "rigid": rigid,
        "bodies": rigid and any(loading.uses_rule for loading in loadable.values()),
        "fastest_first": [backend.name for backend, _ in fastest_first],
        "parameters": _parameter_lines(parameters),
        "about_parameters": about,
    }
    return render("package/init.py.j2", view)


def names_text(
    package: str,
    joints: Sequence[JointEntry],
    links: Mapping[str, Sequence[int]],
    nonquadratic: Iterable[int],
    parameters: Mapping[str, float],
    bodies: Sequence[BodyText],
    passive: Sequence[PassiveJoint],
    file_joints: Sequence[FileJoint],
    energies: EnergiesEntry | None,
) -> str:
    """Return names.py: the joints, the links, and what depends on parameters.

    It has names, units and limits of the joints, their passive properties, the joints of the file, and names
    and paths of the links.
    """
    view = {
        "version": VERSION,
        "name": repr(package),
        "joints": [python_literal(joint.name) for joint in joints],
        "units": [repr(joint.unit) for joint in joints],
        "limits": [(what, _limit_text(what, joints)) for what in JointLimits._fields],
        "links": [python_literal(name) for name in links],
        "paths": [repr(tuple(path)) for path in links.values()],
        "nonquadratic": repr(tuple(sorted(nonquadratic))),
        "written": None if energies is None else _written_texts(energies),
        "parameters": [(python_literal(name), repr(value)) for name, value in parameters.items()],
        "bodies": bodies,
        "passive": [_passive_text(entry) for entry in passive],
        "file_joints": [
            f"{python_literal(one.name)}, {one.kind!r}, {one.coordinates!r}, {one.pinocchio}"
            for one in file_joints
        ],
        "calls_numpy": any("np." in value for body in bodies for value in body.values),
    }
    return render("package/names.py.j2", view)


def _written_texts(energies: EnergiesEntry) -> dict[str, Any]:
    """Return the texts of what links that were written by hand have beside paths."""
    return {
        "shares": [_names_text([share.name for share in link.shares]) for link in energies.links],
        "degrees": repr(tuple(link.degree for link in energies.links)),
        "time": python_literal(energies.time) if energies.time else "",
        "inputs": _names_text(energies.inputs) if energies.inputs else "",
        "constraints": _names_text([one.name for one in energies.constraints])
        if energies.constraints
        else "",
        "holonomic": repr(tuple(one.holonomic for one in energies.constraints)),
        "independent": repr(energies.independent),
        "closed_position": repr(energies.closed_position),
    }


def _names_text(names: Sequence[str]) -> str:
    return f"({', '.join(map(python_literal, names))}{',' if len(names) == 1 else ''})"


def _limit_text(what: str, joints: Iterable[JointEntry]) -> str:
    """Return one limit of each joint, as a tuple of Python with `inf` in it."""
    none = "-inf" if what == "lower" else "inf"
    numbers = [none if (limit := getattr(joint, what)) is None else repr(limit) for joint in joints]
    return f"({', '.join(numbers)},)"


def _passive_text(entry: PassiveJoint) -> str:
    """Return the arguments of a PassiveJoint, which has the fields of the entry; zeros are its defaults."""
    joint, coordinate, ratio, *own = asdict(entry).items()
    moved = python_literal(joint[1]), repr(coordinate[1]), repr(ratio[1])
    return ", ".join([*moved, *(f"{name}={value!r}" for name, value in own if value)])


def _parameter_lines(parameters: Iterable[str]) -> list[str]:
    """Return the names of the parameters as lines of a docstring, which none of their characters can end."""
    lines: list[str] = []
    for parameter in parameters:
        name = python_docstring(parameter)
        if lines and len(lines[-1]) + len(name) < LINE:
            lines[-1] += f" {name},"
        else:
            lines.append(f"{name},")
    return [*lines[:-1], *(last.removesuffix(",") for last in lines[-1:])]
