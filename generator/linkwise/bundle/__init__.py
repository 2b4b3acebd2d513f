"""One file of an analysis, that others run again: its inputs, its choices, its result, and what made it."""

from linkwise.bundle.compare import ResultComparison, compared
from linkwise.bundle.contents import FILE, RESULT, Bundle, WrittenAnalysis, versions_here, written_analysis
from linkwise.bundle.pack import BundledInputs, pack
from linkwise.bundle.unpack import unpacked

__all__ = [
    "FILE",
    "RESULT",
    "Bundle",
    "BundledInputs",
    "ResultComparison",
    "WrittenAnalysis",
    "compared",
    "pack",
    "unpacked",
    "versions_here",
    "written_analysis",
]
