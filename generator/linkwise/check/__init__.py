"""Proof that a generated package is right."""

from linkwise.check.package import Result, check_package

__all__ = ["Result", "check_package"]
