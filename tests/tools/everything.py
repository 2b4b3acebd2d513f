"""Everything that linkwise makes of the robots and the log in the working directory: `same_bytes` runs this.

Arguments are libraries that are to seem missing.
"""

import sys
from importlib.abc import MetaPathFinder
from typing import Any

COMMANDS = (
    "generate planar3 --out out --parameters symbolic",
    "generate skew.toml --out out --backend numpy --backend autograd --backend native",
    "generate torso --out out --backend numpy --backend c",
    "generate cart.py --out out",
    "check out/torso --samples 5",
    "report terms planar3 --joint all --out out/terms",
    "report reduction --dof 1..2 --out out/reduction",
    "motion --out out/motion",
    "analyze log.csv --robot out/skew --out out/analysis --backend numpy --format csv --cutoff 6",
    "analyze log.csv --robot out/skew --out out/plain --backend numpy --format csv --no-page --power-terms",
)


class Missing(MetaPathFinder):
    """Finds none of the libraries that are to seem missing."""

    def __init__(self, libraries: list[str]) -> None:
        self.libraries = libraries

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
        """Raise for them."""
        if name.partition(".")[0] in self.libraries:
            raise ModuleNotFoundError(f"{name} seems missing", name=name)


def main() -> None:
    """Run each command; one that needs a missing library writes nothing."""
    missing = sys.argv[1:]
    sys.meta_path.insert(0, Missing(missing))
    from linkwise.cli.app import main as linkwise

    for command in COMMANDS:
        sys.argv = ["linkwise", *command.split()]
        try:
            linkwise()
        except SystemExit as end:
            if end.code and not missing:
                raise


if __name__ == "__main__":
    main()
