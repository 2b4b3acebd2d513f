"""Compiling an MJCF file by MuJoCo, without what has no part in the dynamics of rigid bodies."""

import os
from pathlib import PurePath
from typing import Any
from warnings import catch_warnings, simplefilter

from linkwise.errors import LinkwiseError
from linkwise.robot.readers.mjcf_files import MjcfFiles

CORNERS = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
FACES = [0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3]
"""Faces of a tetrahedron with these corners."""


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
