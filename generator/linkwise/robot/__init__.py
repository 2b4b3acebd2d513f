"""Robots: what a description says, and the readers for it."""

from linkwise.robot.build import Options
from linkwise.robot.read import BUILT_IN, read_robot
from linkwise.robot.robot import Coordinate, Joint, Link, Note, Robot

__all__ = ["BUILT_IN", "Coordinate", "Joint", "Link", "Note", "Options", "Robot", "read_robot"]
