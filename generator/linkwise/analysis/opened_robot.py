"""A generated robot package as the analysis uses it: names, a back end that works here, bodies, an oracle."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from linkwise_runtime.constraints.independent_joints import loose_base
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.file_joints import FileJoint, Order
from linkwise_runtime.qpos_motion import Qpos
from linkwise_runtime.rule.joint_tree import JointTree
from linkwise_runtime.structure import PassiveJoint, Structure

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.contacts.ground import GroundContacts
from linkwise.analysis.motion_words import MotionWords, shown_joints, words_of
from linkwise.analysis.samples import FollowingJoint
from linkwise.analysis.settings import Payload
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import without_ending
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import Package
from linkwise.package.share_word import share_word


def load_unit(unit: str) -> str:
    """Return the unit of torque or force where motion is in `unit`, "rad" or "m"; both for another."""
    return {"rad": "N·m", "m": "N"}.get(unit, "N·m or N")


@dataclass(frozen=True)
class OpenedRobot:
    """A loaded robot: names in the order of every array, and the back end that computes."""

    name: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    """Unit of each joint, "rad" or "m", in the order of `joints`."""
    links: tuple[str, ...]
    backend: str
    model: Dynamics
    tree: JointTree | None
    """Joints, links and frames; None where the energies were written by hand."""
    up: tuple[float, float, float]
    """Direction against gravity, in the base frame; z for a robot without gravity."""
    manifest_sha256: str
    package: Package
    recursion: NewtonEuler | None = None
    """Independent computation of partial torques; None where the energies were written by hand."""
    passive: tuple[PassiveJoint, ...] = ()
    """Passive elements of the joints that have any: springs, damping, friction, armatures."""
    payloads: tuple[Payload, ...] = ()
    """Payloads, which follow the robot's own links in `links`."""
    constrained: ConstrainedModel | None = None
    """Model of the robot's own links where joints are tied; `model` gives torques of independent joints."""

    contacts: GroundContacts | None = None
    """Contacts on which the robot stands on the ground."""
    undriven: tuple[int, ...] | None = None
    """Numbers of the joints that nothing drives, where somebody said so; None where nobody did."""

    @property
    def structure(self) -> Structure:
        """Robot of the package, in names and numbers."""
        structure: Structure = self.package.module.ROBOT
        return structure

    @property
    def is_written(self) -> bool:
        """True if the links were written by hand, and their shares that are not of motion have names."""
        return bool(self.structure.shares)

    @property
    def is_unstored(self) -> bool:
        """True if shares of links take or give energy that nothing stores, as dissipation does."""
        energies = self.package.manifest.energies
        shares = () if energies is None else (share for link in energies.links for share in link.shares)
        return any(share.forces or {share.motion, share.dissipation} != {"0"} for share in shares)

    @property
    def time_name(self) -> str:
        """Name of the time on which written energies depend; empty where they do not."""
        energies = self.package.manifest.energies
        return "" if energies is None else energies.time

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs of written energies."""
        energies = self.package.manifest.energies
        return () if energies is None else tuple(energies.inputs)

    @property
    def share_rows(self) -> tuple[tuple[int, int, int], ...]:
        """Joint, link and number of every named share, sorted; of independent joints where some are tied."""
        own = [(i, j, m) for i, j, m in self.structure.share_rows.tolist()]
        if self.constrained is not None:
            movers = self.constrained.following.movers
            own = [(y, j, m) for i, j, m in own for y in movers[i]]
        return tuple(sorted(set(own)))

    @property
    def share_names(self) -> tuple[str, ...]:
        """Names of the shares that are not of motion: gravity of rigid links."""
        return self.structure.share_names

    @property
    def potential(self) -> str:
        """Names of these shares as a phrase."""
        return share_word(self.share_names)

    @property
    def followers(self) -> tuple[FollowingJoint, ...]:
        """Joints of the file that follow a joint here or are held, and are no joints here."""
        return FollowingJoint.of(self.package.manifest)

    @property
    def file_joints(self) -> tuple[FileJoint, ...]:
        """Moving joints of the file, where some are several joints here or Pinocchio's order differs."""
        return self.package.manifest.file_joints

    def qpos(self, order: Order, names: Sequence[str] | None) -> Qpos:
        """Return the map from a simulator's positions to the joints.

        names: names of the file's joints in the order of these positions

        Raises ValueError for names of other joints, and where the robot has no file.
        """
        if self.package.manifest.tree is None:
            raise LinkwiseError(
                "the robot is of energies written by hand, which no simulator's file has; log its q"
            )
        found: Qpos = self.package.module.ROBOT.qpos(order, names)
        return found

    def at(self, time: Array, inputs: Array) -> "OpenedRobot":
        """Return the robot at the time (S,) and with the inputs (S, count) of some samples.

        A robot that depends on neither is itself.
        """
        values = dict(zip(self.inputs, inputs.T, strict=True)) if self.inputs else {}
        if self.time_name:
            values[self.time_name] = time
        return replace(self, model=self.model.at(**values)) if values else self

    @property
    def units_in_logs(self) -> tuple[str, ...]:
        """Unit of each joint in logs: "rad" where a log in degrees has degrees, else "m" or "always rad"."""
        always = self.package.manifest.in_radians
        return tuple(
            "always rad" if name in always else unit
            for name, unit in zip(self.joints, self.units, strict=True)
        )

    @property
    def torque_units(self) -> tuple[str, ...]:
        """Unit of each joint's torque, N·m or N."""
        return tuple(map(load_unit, self.units))

    @property
    def reach(self) -> tuple[float, ...]:
        """Largest magnitude that the limits of each joint allow, in its unit; infinite without any."""
        ends = ((joint.lower, joint.upper) for joint in self.package.manifest.joints)
        return tuple(
            math.inf if lower is None or upper is None else max(abs(lower), abs(upper))
            for lower, upper in ends
        )

    @property
    def driven(self) -> tuple[int, ...]:
        """Numbers of the joints that have torques: all, or the independent ones."""
        every = tuple(range(len(self.joints)))
        return every if self.constrained is None else self.constrained.following.independent

    @property
    def driven_joints(self) -> tuple[str, ...]:
        """Names of the joints that have torques."""
        return tuple(self.joints[i] for i in self.driven)

    @property
    def dependent_joints(self) -> tuple[str, ...]:
        """Names of the joints that follow others, and have no torque; none where joints are free."""
        return () if self.constrained is None else tuple(self.constrained.constraints.dependent)

    @property
    def plot_joints(self) -> tuple[str, ...]:
        """Names of all joints for figures and the page: without the "_joint" that all may end in."""
        return without_ending(self.joints)

    @cached_property
    def words(self) -> tuple[MotionWords | None, ...]:
        """Words of each joint of a person and of its directions; None for other joints."""
        return words_of(self.joints, self.package.manifest.tree, self.up)

    @property
    def figure_joints(self) -> tuple[str, ...]:
        """Names of all joints for figures: in words where these are of a person."""
        known = {name: said for name, said in zip(self.joints, self.words, strict=True) if said is not None}
        return shown_joints(self.joints, known) if known else self.plot_joints

    def with_signs(self, unit: str, i: int) -> str:
        """Return a label of an axis: a unit, and in words what is above and below zero for joint i."""
        said = self.words[i]
        return unit if said is None else f"{unit}\n{said.signs}"

    @property
    def plot_links(self) -> tuple[str, ...]:
        """Names of all links for figures and the page: without the "_link" that all may end in."""
        return without_ending(self.links)

    @property
    def residuals(self) -> tuple[int, ...]:
        """Numbers of the joints with torques that nothing drives: as said, or those of a floating base.

        A floating base slides and turns in one place, from the ground to the first link with mass, by three
        coordinates or more, whatever its file calls these.
        """
        if self.contacts is not None:
            return self.contacts.unactuated
        found = self.undriven
        if found is None:
            found = () if self.tree is None else loose_base(self.tree)
        return tuple(i for i in self.driven if i in found)

    @property
    def moving_itself(self) -> tuple[int, ...]:
        """Numbers of the joints that have torques, without residuals; with them if no other is left."""
        return tuple(i for i in self.driven if i not in self.residuals) or self.driven

    @property
    def residuals_apart(self) -> frozenset[int]:
        """Numbers of the joints that are told as residuals, after all others; none if there are no others."""
        return frozenset(self.driven) - frozenset(self.moving_itself)

    def named_apart(self, name: str, i: int) -> str:
        """Return a name of joint i for people: "residual pelvis up" where nothing drives it."""
        return f"residual {name}" if i in self.residuals_apart else name

    @property
    def joints_apart(self) -> tuple[int, ...]:
        """Numbers of the joints that have torques, those that are residuals last."""
        return tuple(dict.fromkeys((*self.moving_itself, *self.driven)))

    def joints_supporting(self, joints: Iterable[int]) -> tuple[int, ...]:
        """Return the numbers of the joints with torques that carry what these joints are loaded with."""
        found = set(joints)
        if self.constrained is not None:
            found = {y for k in joints for y in self.constrained.following.movers[k]}
        if self.contacts is not None and found & set(self.contacts.unactuated):
            found |= set(self.contacts.joints)
        return tuple(sorted(found))

    @property
    def tree_joints(self) -> tuple[str, ...]:
        """Names of the tree's joints, in the order of the package's; none for links that are energies."""
        tree = self.package.manifest.tree
        return () if tree is None else tuple(joint.name for joint in tree.joints)

    @property
    def constraint_rows(self) -> tuple[str, ...]:
        """Names of the rows of ties, couplings and contacts, in the order of a result's forces."""
        tied = () if self.constrained is None else self.constrained.constraints.rows
        return (*tied, *(() if self.contacts is None else self.contacts.rows))

    @property
    def ground(self) -> GroundContacts:
        """Contacts of a robot that stands on some."""
        assert self.contacts is not None
        return self.contacts

    def joint_of(self, frame: object) -> int | None:
        """Return the index of the tree's joint that moves a frame, None for one on the ground."""
        assert self.tree is not None
        return next(one.joint for one in self.tree.frames if one.name == frame)

    @property
    def contact_rows(self) -> slice:
        """Places of the rows of contacts among `constraint_rows`, behind those of ties."""
        count = 0 if self.contacts is None else len(self.contacts.rows)
        return slice(len(self.constraint_rows) - count, len(self.constraint_rows))

    @property
    def holders(self) -> tuple[str, ...]:
        """Names of what holds energy: links, then armatures of joints."""
        return (*self.links, *(f"armature of {self.joints[i]}" for i in self.with_own("armature")))

    def with_own(self, field: str) -> tuple[int, ...]:
        """Return the numbers of the joints that have a passive element, by the name of its number."""
        return tuple(sorted({own.coordinate for own in self.passive if getattr(own, field)}))
