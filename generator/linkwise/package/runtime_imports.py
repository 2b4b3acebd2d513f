"""Imports of the runtime in a package's files: from the library, or from a copy that the package carries."""

import re

RUNTIME = "linkwise_runtime"
OF_LIBRARY = re.compile(rf"^( *)from {RUNTIME}\.", re.MULTILINE)
OF_COPY = re.compile(rf"^( *)from \.+{RUNTIME}\.", re.MULTILINE)


def is_copied(path: str) -> bool:
    """Return whether a file of a package is one of its copy of the runtime."""
    return path.startswith(f"{RUNTIME}/")


def of_copy(path: str, text: str) -> str:
    """Return a package's file with imports from the package's own copy."""
    if not path.endswith(".py") or is_copied(path):
        return text
    dots = "." * (path.count("/") + 1)
    return OF_LIBRARY.sub(rf"\1from {dots}{RUNTIME}.", text)


def of_library(path: str, text: str) -> str:
    """Return a package's file with imports from the library."""
    return text if is_copied(path) else OF_COPY.sub(rf"\1from {RUNTIME}.", text)
