"""From a log of motion and torques to what the links carry: masses, centres, inertias, friction."""

from linkwise.identification.identification_result import Identification
from linkwise.identification.identified_links import Fitting, identify

__all__ = ["Fitting", "Identification", "identify"]
