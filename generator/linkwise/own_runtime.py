"""The runtime that linkwise brings along and works with: its own, and no other."""

from contextlib import suppress
from functools import cache


@cache
def require_own_runtime() -> str:
    """Return the version of linkwise and its runtime; raise ImportError where that is not its own.

    linkwise-runtime alone, installed beside linkwise, lies in the same folder: to remove it takes both away,
    and another version of it stands in the place of linkwise's own.
    """
    from importlib import metadata

    again = "install linkwise again, with --force-reinstall, and no linkwise-runtime beside it"
    try:
        from linkwise_runtime.version import VERSION
    except ModuleNotFoundError:
        raise ImportError(f"linkwise_runtime, which linkwise brings along, is gone; {again}") from None
    with suppress(metadata.PackageNotFoundError):  # run from a checkout, it is nowhere installed
        installed = metadata.version("linkwise")
        if installed != VERSION:
            raise ImportError(f"linkwise {installed} finds linkwise_runtime {VERSION} in its place; {again}")
    return VERSION
