"""Programs that tests need beside Python, and where to get them."""

import shutil

import pytest

PACKAGES = {
    "aarch64-linux-gnu-g++": "g++-aarch64-linux-gnu",
    "aarch64-linux-gnu-gcc": "gcc-aarch64-linux-gnu",
    "arm-none-eabi-g++": "gcc-arm-none-eabi",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "c++": "g++",
    "cc": "gcc",
    "chromedriver": "chromium-driver",
    "clang++": "clang",
    "dot": "graphviz",
    "ninja": "ninja-build",
    "node": "nodejs",
    "qemu-aarch64": "qemu-user",
    "qemu-system-arm": "qemu-system-arm libnewlib-arm-none-eabi",
}
"""Debian's package of a program, where it is not named after it."""


def missing(*programs: str) -> str:
    """Return why what needs these programs cannot run here, and what helps; empty where all are there."""
    absent = [program for program in programs if shutil.which(program) is None]
    packages = dict.fromkeys(PACKAGES.get(program, program) for program in absent)
    return f"needs {', '.join(absent)}: apt-get install {' '.join(packages)}" if absent else ""


def needs(*programs: str) -> pytest.MarkDecorator:
    """Mark of tests that are skipped where one of these programs is not there."""
    return pytest.mark.skipif(missing(*programs) != "", reason=missing(*programs))
