"""A package for given values of its parameters, and the references for its numbers."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import NamedTuple, TypeVar

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree
from linkwise_runtime.structure import PassiveJoint

from linkwise.arrays import Array
from linkwise.check.c_functions import CFunctions
from linkwise.check.compare import IndexRows, Result, skipped
from linkwise.check.compiled_c import CompiledPackage
from linkwise.check.constraint_checks import HeldContacts
from linkwise.check.frame_checks import FrameReference, frame_reference
from linkwise.check.parametric_tree import tree_with
from linkwise.check.reaction_checks import link_reference, reaction_reference
from linkwise.check.regressor_checks import regressor_reference
from linkwise.check.simulated_terms import simulated_terms
from linkwise.check.simulation_checks import SimulatedMotion, simulated_motion
from linkwise.check.sum_checks import regular
from linkwise.check.variance_functions import Uncertain, motion_reference
from linkwise.oracle.energies import TextTerms, energy_reference, states_of_energies
from linkwise.oracle.loop_reference import LoopReference, loop_reference
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import Reference, body_reference, states_of_torques, torque_reference
from linkwise.oracle.states import States, affordable, random_states
from linkwise.oracle.written_constraints import TextConstraints, written_reference
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.load import Package
from linkwise.package.manifest import Manifest

T = TypeVar("T")
LEAST_SECONDS = 300
TIMES = 20
"""Limits of C's processor time: so many s, and so many times the time that was spent before it is called."""
UNBOUNDED = 1 << 50
"""Bytes that stand for unbounded memory."""
LEAST = 10
"""Number of states below which nothing is proved of energies that are not defined everywhere."""


class BackendVariant(NamedTuple):
    """A back end, and the kernel that it computes by."""

    backend: str
    kernel: str = "auto"

    @property
    def label(self) -> str:
        """Name that results are reported under: of two kernels, closed forms have the back end's alone."""
        return f"{self.backend} by rule" if self.kernel == "rule" else self.backend


def long_enough() -> ProcessLimits:
    """Return limits of time in which C that ends at all has ended, for any robot on any machine."""
    return ProcessLimits(LEAST_SECONDS + TIMES * math.ceil(time.process_time()), UNBOUNDED)


def there(what: T | None) -> T:
    """Return `what`, which is not None: a check that concerns a subject finds it there."""
    assert what is not None
    return what


NEAR_NONE = "loops close near none of the states, or only next to singular positions"
SEEDS = (None, 1, 2, 3)
"""Seeds of errors in each operation of what a user wrote; None for none."""


@dataclass(frozen=True)
class Subject:
    """A package for given values of its parameters, and the references for its numbers.

    label: distinguishes its results from those for other values; empty for those as generated
    loaded: its back ends with these values; missing: results on those that could not be loaded
    compiled: its C, None if there is none; headers: results on its headers
    samples: number of random states that are asked for
    """

    package: Package
    label: str
    parameters: Mapping[str, float]
    loaded: Mapping[BackendVariant, Dynamics]
    rows: IndexRows
    compiled: CompiledPackage | None
    samples: int
    missing: Sequence[Result] = ()
    headers: Sequence[Result] = ()

    @cached_property
    def count(self) -> tuple[int, int]:
        """Number of random states that memory allows, and of those at rest."""
        return affordable(self.samples, len(self.manifest.joints), len(self.manifest.links))

    @property
    def as_generated(self) -> bool:
        """True if the parameters have the values that they were generated with."""
        return not self.label

    @property
    def is_defined(self) -> bool:
        """False if the torques have numbers at none of the states that were tried."""
        reference, tried = self.tried_reference
        return reference is not None or not tried

    @property
    def has_numbers(self) -> bool:
        """True if there is a reference for torques."""
        return self.tried_reference[0] is not None

    @property
    def manifest(self) -> Manifest:
        """Manifest of the package."""
        return self.package.manifest

    @cached_property
    def tree(self) -> JointTree | None:
        """Rigid bodies with these parameters; None for energies."""
        tree = self.manifest.tree
        return None if tree is None else tree_with(tree, self.manifest.formulas, self.parameters)

    @property
    def tied(self) -> bool:
        """True if loops of the open tree are closed, or constraints were written with the links."""
        return self.manifest.tied

    @property
    def passive(self) -> tuple[PassiveJoint, ...]:
        """Passive properties of the joints."""
        return self.manifest.passive

    @cached_property
    def functions(self) -> CFunctions | None:
        """Compiled C; None if it did not compile."""
        if self.compiled is None:
            return None
        return CFunctions(self.manifest, self.compiled, self.rows, self.parameters)

    @property
    def reference(self) -> Reference:
        """Reference for torques and their coefficients."""
        return there(self.tried_reference[0])

    @cached_property
    def regressors(self) -> Reference | None:
        """Reference for regressors; None for energies."""
        if self.tree is None:
            return None
        return regressor_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def reactions(self) -> Reference | None:
        """Reference for what joints carry; None for energies."""
        if self.tree is None:
            return None
        return reaction_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def link_wrenches(self) -> Reference | None:
        """Reference for the wrenches of links that C has; None for energies and for joints that are tied."""
        if self.tree is None or self.tied:
            return None
        return link_reference(self.manifest, self.tree, self.rows.tau, self.reference.states)

    @cached_property
    def uncertain(self) -> Uncertain | None:
        """Reference where the motion is uncertain; None for energies."""
        if self.tree is None:
            return None
        return motion_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def frames(self) -> FrameReference | None:
        """Reference for kinematics; None for energies."""
        return None if self.tree is None else frame_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def loops(self) -> LoopReference | None:
        """Reference for constraints; None without ties, or where no state leads to closed loops."""
        if not self.tied:
            return None
        if self.tree is None:
            return self._written_constraints()
        return loop_reference(self.manifest, self.tree, self.reference.states)

    @property
    def closed_states(self) -> States | None:
        """States that the robot can move on from, in which ties close; None if there are none."""
        if not self.tied:
            return None if self.tree is None else self.reference.states
        return None if self.loops is None else self.loops.states

    @cached_property
    def contacts(self) -> HeldContacts:
        """Reference for contacts."""
        return HeldContacts(self.manifest, there(self.tree), there(self.closed_states))

    @cached_property
    def simulation(self) -> SimulatedMotion | str:
        """A short motion, or the reason why there is none."""
        if self.terms is not None:
            inputs, tried = there(self.manifest.energies).inputs, self.reference.states
            if not self.tied:
                tried = tried.at(np.flatnonzero(regular(self.reference)))
                return simulated_terms(self.terms, inputs, tried, None)
            closed = self.closed_states
            return NEAR_NONE if closed is None else simulated_terms(self.terms, inputs, closed, self.ties)
        return simulated_motion(self.manifest, there(self.tree), there(self.closed_states))

    @cached_property
    def terms(self) -> Sequence[Sequence[TextTerms]] | None:
        """Terms of the links, exact, then with errors in each operation; None where nothing can read them."""
        written = self.manifest.energies
        if written is None or not find_spec("torch"):
            return None
        joints = [joint.name for joint in self.manifest.joints]
        return [
            [TextTerms(one, joints, written.time, self.parameters, noise) for one in written.links]
            for noise in SEEDS
        ]

    def _written_constraints(self) -> LoopReference | None:
        """Return the reference for constraints that a user wrote; None where nothing can read their text."""
        if self.terms is None:
            return None
        position = np.array(there(self.manifest.energies).closed_position)
        names = self.package.module.ROBOT.share_names
        return written_reference(self.ties, self.terms, names, position, self.reference.states)

    @cached_property
    def ties(self) -> Sequence[TextConstraints]:
        """Constraints that a user wrote, exact, then with errors in each operation."""
        written, joints = there(self.manifest.energies), [joint.name for joint in self.manifest.joints]
        return [TextConstraints(written, joints, self.parameters, noise) for noise in SEEDS]

    @cached_property
    def tried_reference(self) -> tuple[Reference | None, int]:
        """Reference for numbers, None if nothing can compute or at no state; and how many were tried."""
        manifest = self.manifest
        if self.tree is not None:
            samples, rest = self.count
            states = random_states(manifest.joints, samples, rest=rest)
            recursion, magnitudes = NewtonEuler(manifest, self.tree), Magnitudes(manifest, self.tree)
            return body_reference(recursion, magnitudes, states), len(states.q)
        if self.terms is not None:
            exact, *noisy = self.terms
            names = self.package.module.ROBOT.share_names
            found = states_of_energies(exact, names, manifest.joints, self.count[0])
            defined = len(found.states.q) > 0
            return energy_reference(exact, noisy, names, found.states) if defined else None, found.tried
        if self.package.module.ROBOT.nonquadratic:
            return None, 0  # differences tell apart what is quadratic in the velocities alone
        return self._own_reference()

    def _own_reference(self) -> tuple[Reference | None, int]:
        """Return the reference from torques of a back end, else of the C, and how many states were tried."""

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


def check_energies(name: str, subject: Subject) -> Iterator[Result]:
    """Yield remarks on energies that a user wrote: what they are compared with, and at how many states."""
    if not find_spec("torch"):
        own = "a user's own, and no torch here to differentiate them: its own torques are what counts"
        yield skipped(f"{name}: not held against their text", own)
    reference, tried = subject.tried_reference
    kept = len(reference.states.q) if reference else 0
    detail = f"numbers at {kept} of {tried} random states"
    if tried and kept < min(LEAST, subject.count[0] / 2):
        yield Result(f"{name}: are defined", False, None, f"{detail}: too few to prove anything")
    elif kept < tried:
        yield Result(f"{name}: are defined", True, None, detail)
