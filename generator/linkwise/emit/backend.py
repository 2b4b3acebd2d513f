"""Back ends: each turns a derivation into files; adding one adds an entry here and touches nothing else."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.resources import files

from linkwise.emit.assemble import Derivation
from linkwise.emit.autograd import autograd_files
from linkwise.emit.c.sources import c_files
from linkwise.emit.closed_forms import closed_form_files
from linkwise.emit.formulas import formula_files
from linkwise.emit.render import render

Files = Iterator[tuple[str, str]]


@dataclass(frozen=True)
class Backend:
    """How a back end's files are made; `module` is what `load` imports, empty where nothing loads."""

    name: str
    module: str
    doc: str
    files: Callable[[Derivation], Files]
    needs: tuple[str, ...] = ()


def _runtime(name: str) -> Files:
    from linkwise.version import VERSION

    yield f"{name}.py", render(f"package/{name}.py.j2", {"version": VERSION})


def _autograd(d: Derivation) -> Files:
    yield from autograd_files(d.system, d.linear)
    yield from _runtime("autograd_backend")
    yield from _runtime("torch_backend")


def _torch(d: Derivation) -> Files:
    yield from closed_form_files(d.system, d.kernels, "torch")
    yield from _runtime("torch_backend")


def _numpy(d: Derivation) -> Files:
    yield from closed_form_files(d.system, d.kernels, "numpy")


RUNTIME = (
    "__init__", "arguments", "interface", "numpy_backend", "structure", "torch_backend",
    "native_backend", "native_build", "native_compiler", "native_library", "native_torch",
)  # fmt: skip


def _native(d: Derivation) -> Files:
    from linkwise.version import VERSION

    yield "native.py", render("package/native.py.j2", {"version": VERSION, "package": d.package})
    for name in RUNTIME:
        text = files("linkwise.runtime").joinpath(f"{name}.py").read_text(encoding="utf-8")
        yield f"runtime/{name}.py", text


BACKENDS: dict[str, Backend] = {
    backend.name: backend
    for backend in (
        Backend("numpy", "numpy_backend", "closed forms on NumPy arrays", _numpy),
        Backend("torch", "torch_backend", "closed forms on torch tensors", _torch),
        Backend(
            "autograd",
            "autograd_backend",
            "each link's Lagrangian, differentiated by torch",
            _autograd,
        ),
        Backend(
            "native",
            "native",
            "the C code, compiled by this system's compiler",
            _native,
            ("c", "torch"),
        ),
        Backend("c", "", "closed forms in C99, to compile into a program of your own", c_files),
        Backend("formulas", "", "closed forms to read, for small robots", formula_files),
    )
}
