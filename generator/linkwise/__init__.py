"""linkwise: which joint's movement loads which joint, through which link.

system = linkwise.read_system("planar3")     # or a .toml, .urdf or .py file, or linkwise.energy_system(...)
files = linkwise.generate(system)               # {path: text} of an importable package
"""

__version__ = "0.1.0"

from linkwise.check import check_package
from linkwise.emit.write import write_package
from linkwise.errors import LinkwiseError
from linkwise.model import Coordinate, Options, read_robot
from linkwise.motion import Analysis, Lowpass, Processing, Reading, analyze
from linkwise.pipeline import generate, read_system
from linkwise.symbolic.energies import energy_system
from linkwise.symbolic.system import LinkEnergy, System

__all__ = [
    "Analysis",
    "Coordinate",
    "LinkEnergy",
    "LinkwiseError",
    "Lowpass",
    "Options",
    "Processing",
    "Reading",
    "System",
    "analyze",
    "check_package",
    "energy_system",
    "generate",
    "read_robot",
    "read_system",
    "write_package",
]
