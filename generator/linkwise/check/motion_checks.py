"""Contacts and a simulated motion of a package, against the recursion, from states in which ties close."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from linkwise.check.compare import Result
from linkwise.check.contact_checks import contact_calls
from linkwise.check.simulation_checks import SimulatedMotion, simulated_motion, simulation_calls
from linkwise.check.states import States
from linkwise.package.entries import RigidTree
from linkwise.package.load import Model
from linkwise.package.manifest import Manifest


class MotionReference(NamedTuple):
    """What both are held against."""

    manifest: Manifest
    tree: RigidTree
    states: States
    simulated: SimulatedMotion

    @classmethod
    def of(cls, manifest: Manifest, tree: RigidTree, states: States) -> "MotionReference":
        """Of rigid links with the tree's numbers."""
        return cls(manifest, tree, states, simulated_motion(manifest, tree, states))

    def calls(self, name: str, model: Model, contact: Callable[..., Any]) -> Iterator[Result]:
        """Results of one back end; contact: the package's own record."""
        yield from contact_calls(name, model, self.manifest, self.tree, self.states, contact)
        yield from simulation_calls(name, model, self.simulated)
