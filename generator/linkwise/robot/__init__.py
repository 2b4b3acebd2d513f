"""Robots: descriptions read from files, and the robots that are built of them."""

from linkwise.robot.notes import Note, effects, kept_apart, left_out
from linkwise.robot.options import Options
from linkwise.robot.read import BUILT_IN, DESCRIPTIONS, is_description, read_robot, robot_files, told_name
from linkwise.robot.robot import Coordinate, Joint, Link, Robot

__all__ = [
    "BUILT_IN",
    "DESCRIPTIONS",
    "Coordinate",
    "Joint",
    "Link",
    "Note",
    "Options",
    "Robot",
    "effects",
    "is_description",
    "kept_apart",
    "left_out",
    "read_robot",
    "robot_files",
    "told_name",
]
