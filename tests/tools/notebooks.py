"""Run the notebooks of examples/ from top to bottom, as a newcomer would, and keep the pictures they draw.

A cell whose metadata has a `picture` draws docs/pictures/NAME.png, which docs/gallery.md shows. Notebooks are
kept without outputs. `python tests/tools/notebooks.py` runs all and brings pictures up to date.
"""

import os
import sys
import tempfile
from base64 import b64decode
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
PICTURES = ROOT / "docs/pictures"
INLINE = "module://matplotlib_inline.backend_inline"
SECONDS = 600
"""Time for a cell, on a machine that does much else."""


def executed(notebook: Path, folder: Path) -> dict[str, bytes]:
    """Run a notebook in a folder, and return its pictures, PNG by name; what fails is raised."""
    nb = nbformat.read(notebook, as_version=4)
    here = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": INLINE}
    client = NotebookClient(nb, timeout=SECONDS, resources={"metadata": {"path": str(folder)}})
    client.execute(env=os.environ | here)
    cells = [cell for cell in nb.cells if cell.cell_type == "code"]
    for cell in cells:
        refuse_failed_commands(cell)
    return {cell.metadata["picture"]: picture_of(cell) for cell in cells if "picture" in cell.metadata}


def refuse_failed_commands(cell: nbformat.NotebookNode) -> None:
    """Raise where a command that a cell called failed: of `!linkwise …`, Jupyter says nothing."""
    printed = "".join(output.get("text", "") for output in cell.outputs)
    if "linkwise: error" in printed or "not found" in printed:
        raise RuntimeError(f"{cell.source}\n{printed}")


def picture_of(cell: nbformat.NotebookNode) -> bytes:
    """Return the one picture among a cell's outputs, as PNG."""
    [data] = [output.data["image/png"] for output in cell.outputs if "image/png" in output.get("data", {})]
    return b64decode(data)


def main() -> None:
    """Run the notebooks, or those named, and write their pictures."""
    for notebook in [Path(name).resolve() for name in sys.argv[1:]] or NOTEBOOKS:
        print(notebook.relative_to(ROOT), flush=True)
        with tempfile.TemporaryDirectory() as folder:
            for name, content in executed(notebook, Path(folder)).items():
                (PICTURES / f"{name}.png").write_bytes(content)


if __name__ == "__main__":
    main()
