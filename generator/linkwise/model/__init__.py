"""Robots: what a description says, and the readers for it."""

from linkwise.model.assemble import Options
from linkwise.model.read import BUILT_IN, read_robot
from linkwise.model.robot import Coordinate, Joint, Link, Note, Robot

__all__ = ["BUILT_IN", "Coordinate", "Joint", "Link", "Note", "Options", "Robot", "read_robot"]
