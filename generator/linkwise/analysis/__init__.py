"""Torque analysis of motion logs: who loads whom in a recorded movement."""

from linkwise_runtime.quantities import Contact

from linkwise.analysis.contacts import Contacts, WhileColumn
from linkwise.analysis.job import Analysis
from linkwise.analysis.loads import Load, Muscles
from linkwise.analysis.markers import MarkerChoices
from linkwise.analysis.run import analyze
from linkwise.analysis.settings import Lowpass, Payload, Processing, Reading

__all__ = [
    "Analysis",
    "Contact",
    "Contacts",
    "Load",
    "Lowpass",
    "MarkerChoices",
    "Muscles",
    "Payload",
    "Processing",
    "Reading",
    "WhileColumn",
    "analyze",
]
