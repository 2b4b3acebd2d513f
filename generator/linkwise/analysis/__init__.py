"""From a recorded movement to who loads whom: torque analysis of motion logs."""

from linkwise.analysis.loads import Load
from linkwise.analysis.run import Analysis, analyze
from linkwise.analysis.settings import Lowpass, Payload, Processing, Reading

__all__ = ["Analysis", "Load", "Lowpass", "Payload", "Processing", "Reading", "analyze"]
