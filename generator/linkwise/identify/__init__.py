"""From a log of motion and torques to what the links carry: masses, centres, inertias, friction."""

from linkwise.identify.identification import Identification, identify

__all__ = ["Identification", "identify"]
