"""Identification of the links' masses, centres, inertias and friction from a log of motion and torques."""

from linkwise.identification.identification_result import Identification
from linkwise.identification.identified_links import Fitting, identify

__all__ = ["Fitting", "Identification", "identify"]
