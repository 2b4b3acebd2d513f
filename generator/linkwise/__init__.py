"""linkwise: which joint's movement loads which joint, through which link.

system = linkwise.read_system("planar3")     # or a .toml, .urdf or .py file, or linkwise.energy_system(...)
files = linkwise.generate(system)               # {path: text} of an importable package
"""

from linkwise.analysis import Analysis, Lowpass, Processing, Reading, analyze
from linkwise.check import check_package
from linkwise.errors import LinkwiseError
from linkwise.package.write import write_package
from linkwise.pipeline import generate, read_system
from linkwise.robot import Coordinate, Options, read_robot
from linkwise.symbolic.system import LinkEnergy, System
from linkwise.symbolic.user_energies import energy_system
from linkwise.version import VERSION as __version__

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
    "__version__",
    "analyze",
    "check_package",
    "energy_system",
    "generate",
    "read_robot",
    "read_system",
    "write_package",
]
