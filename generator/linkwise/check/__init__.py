"""Proof that a generated package is right."""

from linkwise.check.checks import check_package, results_of
from linkwise.check.compare import Result

__all__ = ["Result", "check_package", "results_of"]
