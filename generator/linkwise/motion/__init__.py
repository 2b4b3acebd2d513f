"""From a recorded movement to who loads whom: torque analysis of motion logs."""

from linkwise.motion.analysis import Analysis
from linkwise.motion.run import analyze
from linkwise.motion.settings import Lowpass, Processing, Reading

__all__ = ["Analysis", "Lowpass", "Processing", "Reading", "analyze"]
