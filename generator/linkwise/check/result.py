"""What one check found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Result:
    """One check: its name, whether it passed, the largest error (None: not a number's matter), and a line."""

    name: str
    passed: bool
    error: float | None
    detail: str

    @property
    def mark(self) -> str:
        """Return ok, FAIL or skip."""
        return "ok" if self.passed else "FAIL"


class Skipped(Result):
    """A check that could not be made here, which speaks neither for the package nor against it."""

    def __init__(self, name: str, detail: str) -> None:
        super().__init__(name, True, None, detail)

    @property
    def mark(self) -> str:
        """Return skip."""
        return "skip"
