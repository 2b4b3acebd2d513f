"""Version of this runtime, which is also that of linkwise, and the check of the packages that it runs."""

import re

VERSION = "0.1.0"


def require(version: str) -> None:
    """Raise ImportError unless this runtime runs packages that linkwise `version` generated.

    It runs packages of its own minor version, up to its own patch; a text that is no such version is refused.
    """
    own, asked = (_numbers(text) for text in (VERSION, version))
    is_later = own is not None and asked is not None and own[:2] == asked[:2] and own > asked
    if not (version == VERSION or is_later):
        raise ImportError(
            f"this package is made for linkwise_runtime {version}, but {VERSION} is installed: generate it "
            f"again, or install linkwise {version}, or linkwise-runtime {version} where linkwise is not"
        )


def _numbers(version: str) -> tuple[int, ...] | None:
    found = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version)
    return tuple(map(int, found.groups())) if found else None
