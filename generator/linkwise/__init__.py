"""linkwise: which joint's movement loads which joint, through which link.

system = linkwise.read_system("planar3")     # or a .toml, .urdf or .py file, or linkwise.energy_system(...)
files = linkwise.generate(system)               # {path: text} of an importable package
"""

from importlib import import_module
from typing import TYPE_CHECKING

from linkwise.errors import LinkwiseError
from linkwise.own_runtime import require_own_runtime

if TYPE_CHECKING:
    __version__: str
    from linkwise.analysis import (
        Analysis,
        Contact,
        Contacts,
        Load,
        Lowpass,
        MarkerChoices,
        Muscles,
        Payload,
        Processing,
        Reading,
        WhileColumn,
        analyze,
    )
    from linkwise.check import check_package
    from linkwise.identification import Fitting, Identification, identify
    from linkwise.package.write import write_package
    from linkwise.package_cache import KeptPackage, kept_package
    from linkwise.pipeline import generate, read_system
    from linkwise.robot import Coordinate, Options, read_robot
    from linkwise.study import ProcessPool, RayCluster, StudyOutcome, run_study
    from linkwise.symbolic.moving_bodies import Particle, RigidBody
    from linkwise.symbolic.sympy_system import from_sympy
    from linkwise.symbolic.system import LinkEnergy, System
    from linkwise.symbolic.tables import interpolated
    from linkwise.symbolic.user_energies import energy_system

__all__ = [
    "Analysis",
    "Contact",
    "Contacts",
    "Coordinate",
    "Fitting",
    "Identification",
    "KeptPackage",
    "LinkEnergy",
    "LinkwiseError",
    "Load",
    "Lowpass",
    "MarkerChoices",
    "Muscles",
    "Options",
    "Particle",
    "Payload",
    "ProcessPool",
    "Processing",
    "RayCluster",
    "Reading",
    "RigidBody",
    "StudyOutcome",
    "System",
    "WhileColumn",
    "__version__",
    "analyze",
    "check_package",
    "energy_system",
    "from_sympy",
    "generate",
    "identify",
    "interpolated",
    "kept_package",
    "read_robot",
    "read_system",
    "run_study",
    "write_package",
]

_ROOM_OF = {
    "Analysis": "analysis",
    "RigidBody": "symbolic.moving_bodies",
    "Contact": "analysis",
    "Contacts": "analysis",
    "Coordinate": "robot",
    "Fitting": "identification",
    "Identification": "identification",
    "KeptPackage": "package_cache",
    "LinkEnergy": "symbolic.system",
    "Load": "analysis",
    "Lowpass": "analysis",
    "MarkerChoices": "analysis",
    "Muscles": "analysis",
    "Options": "robot",
    "Particle": "symbolic.moving_bodies",
    "Payload": "analysis",
    "ProcessPool": "study",
    "Processing": "analysis",
    "RayCluster": "study",
    "Reading": "analysis",
    "StudyOutcome": "study",
    "System": "symbolic.system",
    "WhileColumn": "analysis",
    "analyze": "analysis",
    "check_package": "check",
    "energy_system": "symbolic.user_energies",
    "from_sympy": "symbolic.sympy_system",
    "generate": "pipeline",
    "identify": "identification",
    "interpolated": "symbolic.tables",
    "kept_package": "package_cache",
    "read_robot": "robot",
    "read_system": "pipeline",
    "run_study": "study",
    "write_package": "package.write",
}
"""Package of each name, imported when one of its names is first used, and SymPy, NumPy and SciPy not
before."""


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if not TYPE_CHECKING:  # for a type checker, any name would be one of linkwise's

    def __getattr__(name: str) -> object:
        if name not in {*_ROOM_OF, "__version__"}:
            raise AttributeError(f"module 'linkwise' has no attribute {name!r}")
        version = require_own_runtime()
        if name == "__version__":
            return version
        return getattr(import_module(f"linkwise.{_ROOM_OF[name]}"), name)
