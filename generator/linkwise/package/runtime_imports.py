"""Where a package's files import the runtime from: the library, or a copy that the package carries."""

import re

RUNTIME = "linkwise_runtime"
OF_LIBRARY = re.compile(rf"^( *)from {RUNTIME}\.", re.MULTILINE)
OF_COPY = re.compile(rf"^( *)from \.+{RUNTIME}\.", re.MULTILINE)


def is_copied(path: str) -> bool:
    """Whether a file of a package is one of its copy of the runtime."""
    return path.startswith(f"{RUNTIME}/")


def of_copy(path: str, text: str) -> str:
    """A package's file, importing the package's own copy."""
    if not path.endswith(".py") or is_copied(path):
        return text
    dots = "." * (path.count("/") + 1)
    return OF_LIBRARY.sub(rf"\1from {dots}{RUNTIME}.", text)


def of_library(path: str, text: str) -> str:
    """The same file, importing the library."""
    return text if is_copied(path) else OF_COPY.sub(rf"\1from {RUNTIME}.", text)
