"""linkwise_add_robot for other machines: a toolchain file is all that their builds have more."""

from pathlib import Path

import pytest
from helpers.needed import needs

from emit.test_cmake import LISTS, Project, expected, write_project

pytestmark = pytest.mark.ship

TOOLCHAIN = """set(CMAKE_SYSTEM_NAME {system})
set(CMAKE_SYSTEM_PROCESSOR {processor})
set(CMAKE_C_COMPILER {prefix}-gcc)
set(CMAKE_CXX_COMPILER {prefix}-g++)
set(CMAKE_FIND_ROOT_PATH /usr/{prefix})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
"""
TOOLS = ("cmake", "ninja")
ARM, AARCH64 = 40, 183
"""Machines, as ELF files number them."""


def configured(project: Project, toolchain: str) -> Project:
    (project.source / "toolchain.cmake").write_text(toolchain)
    done = project.configure(f"-DCMAKE_TOOLCHAIN_FILE={project.source / 'toolchain.cmake'}")
    assert done.returncode == 0, done.stderr
    return project


def machines(library: Path) -> set[int]:
    """Return the machines that the ELF files in an archive are for."""
    parts = library.read_bytes().split(b"\x7fELF")[1:]
    assert parts
    return {int.from_bytes(part[14:16], "little") for part in parts}


@needs(*TOOLS, "aarch64-linux-gnu-gcc", "aarch64-linux-gnu-g++", "qemu-aarch64")
def test_programs_for_aarch64_say_what_python_does(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "for aarch64")
    shared = "linkwise_add_robot(arm_shared"
    write_project(project.source, LISTS.replace(shared, f"# {shared}").replace("arm_shared)", "arm)"))
    prefix = "aarch64-linux-gnu"
    configured(project, TOOLCHAIN.format(system="Linux", processor="aarch64", prefix=prefix)).make()
    assert machines(project.build / "libarm.a") == {AARCH64}
    tau = expected(project, tmp_path)
    emulator = ("qemu-aarch64", "-L", f"/usr/{prefix}")
    for program, accuracy in (("in_c", 1e-14), ("in_cpp", 1e-14), ("in_float", 1e-6)):
        answer = project.answer(program, *emulator)
        assert answer == pytest.approx(tau, rel=accuracy, abs=accuracy), program


@needs(*TOOLS, "arm-none-eabi-gcc", "arm-none-eabi-g++")
def test_a_library_for_a_microcontroller_is_made_by_its_toolchain(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "for cortex-m")
    robot = 'linkwise_add_robot(arm ROBOT "arm one.urdf" FLOAT)\n'
    write_project(project.source, LISTS.partition("linkwise_add_robot")[0] + robot)
    toolchain = TOOLCHAIN.format(system="Generic", processor="arm", prefix="arm-none-eabi") + (
        "set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)\n"
        'set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard")\n'
    )
    configured(project, toolchain).make()
    assert machines(project.build / "libarm.a") == {ARM}
