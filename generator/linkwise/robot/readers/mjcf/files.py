"""Files that an MJCF file is made of, and compiling them by MuJoCo.

They are the file's own, those that it includes or attaches, its meshes and its pictures; what has no part in
the dynamics of rigid bodies is left out of the compilation.
"""

import os
import re
import stat
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from html import unescape
from itertools import product
from pathlib import Path, PurePath
from typing import Any
from warnings import catch_warnings, simplefilter

from linkwise.bounded_file import content
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import require_file
from linkwise.robot.readers.xml_file import LARGEST

NAMED = re.compile(rb"""\b(file|assetdir|meshdir|texturedir)\w*+\s*+=\s*+(?:"([^"]*)"|'([^']*)')""")
"""Names of files and their folders: MuJoCo reads what is not quite XML, so that no parser finds them."""
BEFORE_XML = b"\xef\xbb\xbf \t\r\n"
MOST = 100_000
"""Most places that are looked into; for a robot these are some hundred."""

CORNERS = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
FACES = [0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3]
"""Faces of a tetrahedron with these corners."""


@dataclass(frozen=True)
class MjcfFiles:
    """Files that are there: `documents` of XML, the robot's own first, and `others`, which these name."""

    documents: tuple[Path, ...]
    others: tuple[Path, ...]


def mjcf_files(path: Path) -> MjcfFiles:
    """Return all files that MuJoCo may open for a robot's file.

    MuJoCo looks for a name in some of the folders of the documents, and of those that their <compiler> gives;
    this looks in all of them. Raises LinkwiseError for far too large a document, and for a device or a pipe,
    for whose end MuJoCo would wait.
    """
    named, found = _NamedFiles(), {os.path.realpath(path): path}
    fresh = dict(found)
    while fresh:
        for file in fresh.values():
            with nullcontext() if file is path else within(str(file)):
                named.read(file)
        there = {os.path.realpath(file): file for file in named.there()}
        fresh = {real: file for real, file in there.items() if real not in found and _is_xml(file)}
        found |= fresh
    return MjcfFiles(tuple(found.values()), tuple(there[real] for real in there if real not in found))


@dataclass
class _NamedFiles:
    """Files that documents name, and the folders that they may be in; dictionaries keep the order."""

    folders: dict[Path, None] = field(default_factory=dict)
    below: dict[str, None] = field(default_factory=lambda: {"": None})
    """Paths below `folders`, as <compiler> gives them."""
    files: dict[str, None] = field(default_factory=dict)

    def read(self, path: Path) -> None:
        """Add the files that a document names.

        Raises LinkwiseError for far too large a document, and for too many places.
        """
        self.folders[path.parent] = None
        for kind, *quoted in NAMED.findall(content(path, LARGEST)):
            name = unescape(b"".join(quoted).decode("utf-8", "surrogateescape"))
            if kind == b"file":
                self.files |= dict.fromkeys((name, os.path.basename(name)))  # the latter by strippath
            else:
                self.below[name] = None
        if len(self.folders) * len(self.below) * len(self.files) > MOST:
            raise LinkwiseError(f"its files may be in more than {MOST:,} places; name fewer files or folders")

    def there(self) -> Iterator[Path]:
        """Yield the named files that exist; raises LinkwiseError for one without an end."""
        for folder, part, name in product(self.folders, self.below, self.files):
            path = folder / part / name
            try:
                mode = path.stat().st_mode
            except (OSError, ValueError):  # not there, or not a path at all
                continue
            if not stat.S_ISDIR(mode):
                with within(str(path)):
                    require_file(path)
                yield path


def _is_xml(path: Path) -> bool:
    """Return whether a file begins as XML does; other files that may be attached name no files."""
    with path.open("rb") as file:
        return file.read(1 << 10).lstrip(BEFORE_XML).startswith(b"<")


def compile_model(mujoco: Any, files: MjcfFiles, text: bytes | None = None) -> tuple[Any, list[str]]:
    """Return the model, and MuJoCo's warnings, which it would write into a file in the working directory.

    text: replaces the content of the first document

    Raises LinkwiseError with MuJoCo's own words, and MemoryError.
    """
    warnings: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warnings.append)
    try:
        spec = _parsed(mujoco, files, text)
        _lighten(mujoco, spec, files, text)
        with catch_warnings(record=True) as noted:
            simplefilter("always")
            return spec.compile(), [*warnings, *(str(one.message) for one in noted)]
    except RuntimeError as error:  # of C++'s own, without a word: there is no memory for an array
        raise MemoryError from error
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        told = "; ".join(" ".join(text.split()) for text in (str(error), *warnings))
        raise LinkwiseError(f"MuJoCo cannot compile it: {told}") from None
    finally:
        mujoco.set_mju_user_warning(before)


def _parsed(mujoco: Any, files: MjcfFiles, text: bytes | None) -> Any:
    """Return the file's elements as MuJoCo has them; nothing but documents has been opened."""
    path, *included = files.documents
    if text is None and path.suffix == ".xml":  # it decodes no other
        return mujoco.MjSpec.from_file(str(path))
    assets = {os.path.relpath(file, path.parent): file.read_bytes() for file in included}
    spec = mujoco.MjSpec.from_string((text or path.read_bytes()).decode(), assets)
    spec.modelfiledir = str(path.parent)
    return spec


def _lighten(mujoco: Any, spec: Any, files: MjcfFiles, text: bytes | None) -> None:
    """Replace textures, height fields, and meshes without mass by the smallest that MuJoCo accepts.

    They keep their names, so that references to them stay valid.
    """
    for texture in spec.textures:
        _let_go_of(texture)
        texture.cubefiles = [""] * len(texture.cubefiles)
        texture.builtin, texture.mark = mujoco.mjtBuiltin.mjBUILTIN_FLAT, mujoco.mjtMark.mjMARK_NONE
        is_flat = texture.type == mujoco.mjtTexture.mjTEXTURE_2D
        texture.width, texture.height, texture.gridsize = 1, 1 if is_flat else 6, [1, 1]
    for terrain in spec.hfields:
        _let_go_of(terrain)
        terrain.nrow, terrain.ncol, terrain.userdata = 2, 2, [0.0] * 4
    # A body that is attached follows the compiler of its own file; the world has no mass.
    texts = (text, *(file.read_bytes() for file in files.documents))
    by_geoms = any(b"inertiafromgeom" in one for one in texts if one)
    weighed = [body for body in spec.bodies[1:] if by_geoms or not body.explicitinertial]
    weighing = {geom.meshname for body in weighed for geom in body.geoms}
    for mesh in spec.meshes:
        if mesh.file and (mesh.name or PurePath(mesh.file).stem) not in weighing:
            _let_go_of(mesh)
            mesh.uservert, mesh.userface, mesh.scale = CORNERS, FACES, [1.0, 1.0, 1.0]


def _let_go_of(asset: Any) -> None:
    """Detach an asset from its file; without a name of its own it gets the file's."""
    if asset.file:
        asset.name = asset.name or PurePath(asset.file).stem
        asset.file = ""
