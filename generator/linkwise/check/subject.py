"""A package for given values of its parameters, and what its numbers are held against."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import NamedTuple, TypeVar

from linkwise_runtime.dynamics import Dynamics

from linkwise.check.body_reference import body_reference
from linkwise.check.c_functions import CFunctions
from linkwise.check.compiled_c import CompiledPackage
from linkwise.check.contact_checks import HeldContacts
from linkwise.check.energy_reference import energy_reference, states_of_energies
from linkwise.check.frame_reference import FrameReference, frame_reference
from linkwise.check.loop_reference import LoopReference, loop_reference
from linkwise.check.magnitudes import Magnitudes
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.packed_layout import IndexRows
from linkwise.check.parametric_tree import tree_with
from linkwise.check.reference import Reference
from linkwise.check.regressor_reference import regressor_reference
from linkwise.check.simulation_checks import SimulatedMotion, simulated_motion
from linkwise.check.states import States, random_states
from linkwise.check.text_lagrangian import TextLagrangian
from linkwise.check.torque_reference import states_of_torques, torque_reference
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.entries import PassiveEntry, RigidTree
from linkwise.package.load import Array, Package
from linkwise.package.manifest import Manifest

T = TypeVar("T")
LEAST_SECONDS = 300
TIMES = 20
"""C may take so much of the processor's time, and so many times what was done before it is called."""
UNBOUNDED = 1 << 50
"""Bytes of memory, which are not bounded."""


class Way(NamedTuple):
    """A back end, and the kernel that it computes by."""

    backend: str
    kernel: str

    @property
    def label(self) -> str:
        """What results are told under: of two kernels, closed forms bear the name of the back end alone."""
        return f"{self.backend} by rule" if self.kernel == "rule" else self.backend


def long_enough() -> ProcessLimits:
    """Time in which C that ends at all has ended, of a robot of any size on any machine."""
    return ProcessLimits(LEAST_SECONDS + TIMES * math.ceil(time.process_time()), UNBOUNDED)


def there(what: T | None) -> T:
    """What a check that concerns a subject finds there."""
    assert what is not None
    return what


@dataclass(frozen=True)
class Subject:
    """A package for given values of its parameters, and what its numbers are held against.

    label: what tells its results from those for other values
    """

    package: Package
    label: str
    parameters: Mapping[str, float]
    loaded: Mapping[Way, Dynamics]
    rows: IndexRows
    compiled: CompiledPackage | None
    count: tuple[int, int]
    """Of random states, and of those at rest."""

    @property
    def composed_elsewhere(self) -> bool:
        """Whether what autograd takes long for, of a large robot, is held of torch, which is alike in it."""
        return self.reference.is_large and any(way.backend == "torch" for way in self.loaded)

    @property
    def manifest(self) -> Manifest:
        """That of the package."""
        return self.package.manifest

    @cached_property
    def tree(self) -> RigidTree | None:
        """Rigid bodies with these parameters; energies have none."""
        tree = self.package.manifest.tree
        return None if tree is None else tree_with(tree, self.parameters)

    @property
    def tied(self) -> bool:
        """Whether loops of the open tree are closed."""
        return self.tree is not None and self.tree.tied

    @property
    def passive(self) -> tuple[PassiveEntry, ...]:
        """What joints take of their own."""
        return () if self.tree is None else self.tree.passive

    @cached_property
    def functions(self) -> CFunctions | None:
        """The C, if it compiled."""
        if self.compiled is None:
            return None
        return CFunctions(self.package.manifest, self.compiled, self.rows, self.parameters)

    @property
    def reference(self) -> Reference:
        """What torques and their coefficients are held against."""
        return there(self.found[0])

    @cached_property
    def regressors(self) -> Reference | None:
        """What regressors are held against; energies have none."""
        if self.tree is None:
            return None
        return regressor_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def frames(self) -> FrameReference | None:
        """What kinematics is held against; energies have none."""
        return None if self.tree is None else frame_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def loops(self) -> LoopReference | None:
        """What constraints are held against; a robot without ties has none."""
        if self.tree is None or not self.tied:
            return None
        return loop_reference(self.manifest, self.tree, self.reference.states)

    @property
    def closed(self) -> States | None:
        """States that the robot can move on from: where ties close."""
        if not self.tied:
            return None if self.tree is None else self.reference.states
        return None if self.loops is None else self.loops.states

    @cached_property
    def contacts(self) -> HeldContacts:
        """What contacts are held against."""
        return HeldContacts(self.manifest, there(self.tree), there(self.closed))

    @cached_property
    def simulated(self) -> SimulatedMotion | str:
        """A short motion, or why there is none."""
        return simulated_motion(self.manifest, there(self.tree), there(self.closed))

    @cached_property
    def found(self) -> tuple[Reference | None, int]:
        """What numbers are held against, None if nothing can compute or at no state; how many were tried."""
        manifest = self.manifest
        if self.tree is not None:
            samples, rest = self.count
            states = random_states(manifest.joints, samples, rest=rest)
            recursion, magnitudes = NewtonEuler(manifest, self.tree), Magnitudes(manifest, self.tree)
            return body_reference(recursion, magnitudes, states), len(states.q)
        if manifest.energies is not None and find_spec("torch"):
            noises = (None, 1, 2, 3)
            exact, *noisy = (
                [TextLagrangian(energy, self.parameters, noise) for energy in manifest.energies]
                for noise in noises
            )
            found = states_of_energies(exact, manifest.joints, self.count[0])
            defined = len(found.states.q) > 0
            return energy_reference(exact, noisy, found.states) if defined else None, found.tried
        return self._own_reference()

    def _own_reference(self) -> tuple[Reference | None, int]:
        """The torques of one of the package's back ends, else those of its C."""

        def of(name: str, torque: Callable[[Array, Array, Array], Array]) -> tuple[Reference | None, int]:
            found = states_of_torques(torque, self.manifest.joints, self.count[0])
            reference = torque_reference(name, torque, found.states) if len(found.states.q) else None
            return reference, found.tried

        if self.loaded:
            way, model = next(iter(self.loaded.items()))
            return of(way.label, model.partial_torque)
        functions = self.functions
        if functions is None:
            return None, 0
        return in_own_process(lambda: of("c", functions.torque), long_enough())
