"""A generated package, imported from its folder, and its back ends with NumPy arrays in and out."""

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.version import VERSION

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, LinkwiseWarning
from linkwise.extras import extra
from linkwise.package.agreement import disagreements
from linkwise.package.contents import changed_files
from linkwise.package.emitted_text import foreign
from linkwise.package.importer import import_listed
from linkwise.package.manifest import Manifest, altered_entries


@dataclass(frozen=True)
class Package:
    """A generated package: its folder, its manifest, and its imported module."""

    directory: Path
    manifest: Manifest
    module: ModuleType
    source: str = ""
    """Robot's file or name, as it was given, of which this package is kept; empty for one of the user's."""

    @property
    def called(self) -> str:
        """Robot or folder that messages name."""
        return self.source or str(self.directory)

    @property
    def remedy(self) -> str:
        """Words on how to come by numpy, which does all, where the package has another back end alone."""
        if self.source:
            return "leave --backend out, or give numpy"
        return "generate the robot again, with --backend numpy beside the others"

    @property
    def backends(self) -> tuple[str, ...]:
        """Names of the back ends that can be loaded."""
        return tuple(self.module.BACKENDS)

    @property
    def fastest_first(self) -> tuple[str, ...]:
        """Names of the back ends that can be loaded, the fastest for large batches first."""
        return tuple(self.module.FASTEST_FIRST)

    def load(
        self,
        backend: str,
        parameters: Mapping[str, float] | None = None,
        kernel: str = "auto",
        bodies: Any = None,
    ) -> Dynamics:
        """Return the model on a back end, for any parameters and bodies; passes on what a package raises."""
        # The argument is left out for packages made before there were kernels to choose from.
        chosen: dict[str, Any] = {} if kernel == "auto" else {"kernel": kernel}
        chosen |= {} if bodies is None else {"bodies": bodies}
        with refuse_exit():
            dynamics: Dynamics = self.module.load(backend, parameters, allow_unphysical=True, **chosen)
        return cast(Dynamics, TensorModel(dynamics)) if dynamics.backend.takes_tensors else dynamics


@contextmanager
def refuse_exit() -> Iterator[None]:
    """Raise LinkwiseError where a package's code would end this process, as by SystemExit.

    Ctrl-C and errors pass through.
    """
    try:
        yield
    except (Exception, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise LinkwiseError(f"its code would end this process by {error!r}") from error


def open_package(directory: Path) -> Package:
    """Read and import the package in `directory`, all files of which must be as generated.

    Raises LinkwiseError otherwise, with the first file or entry of the manifest that differs.
    """
    manifest = Manifest.read(directory)
    for fault in (*altered_entries(directory), *changed_files(directory, manifest.files)):
        raise LinkwiseError(f"{directory}: {fault}; generate the robot again")
    version = manifest.generator.get("linkwise")
    if version != VERSION:
        told = f"its runtime is that of linkwise {version}, which is not at hand to compare with"
        remedy = "its code runs as it is; generate the robot again if you do not know where it comes from"
        warnings.warn(f"{directory}: {told}: {remedy}", LinkwiseWarning, stacklevel=2)
    for fault in foreign(directory, manifest):
        raise LinkwiseError(f"{directory}: {fault}; nothing of it is run: generate the robot again")
    try:
        package = load_package(directory, manifest)
    except Exception as error:  # a damaged file may raise anything
        reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise LinkwiseError(
            f"{directory}: cannot be imported ({reason}); generate the robot again"
        ) from error
    for fault in disagreements(manifest, package.module):
        raise LinkwiseError(f"{directory}: {fault}; generate the robot again")
    return package


def load_package(directory: Path, manifest: Manifest) -> Package:
    """Import the package of a manifest; passes on whatever the package raises."""
    with refuse_exit():
        return Package(directory, manifest, import_listed(directory, manifest))


def import_package(directory: Path) -> ModuleType:
    """Import a package from its folder.

    Raises LinkwiseError for a damaged manifest, ImportError for files that differ from those that it lists.
    """
    return import_listed(directory, Manifest.read(directory))


class TensorModel:
    """A model whose back end takes torch tensors, with NumPy arrays in and out."""

    def __init__(self, dynamics: Any) -> None:
        self._dynamics = dynamics

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._dynamics, name)
        return _answering(found) if callable(found) else found


def _answering(call: Any) -> Any:
    def answer(*motion: Array, **options: Any) -> Any:
        torch = extra("torch")
        result = call(*(torch.from_numpy(np.array(m)) for m in motion), **options)
        if isinstance(result, tuple):
            return type(result)(*map(_array, result))
        return _array(result)

    return answer


def _array(value: Any) -> Any:
    return value.detach().numpy() if hasattr(value, "detach") else value
