"""Joints whose whole wrench is told by cause: links and loads, and what ties and contacts pass on of them.

Contacts take their part as they do of torques, see `contacts.ground`: for each cause x with its torques T_x,

    W_x = W_x of the robot without contacts + sum_c e_c lambda_x,c - sum_t e_t lambda(A^T lambda_x)_t

with lambda_x the forces of contacts, e_c what the joint carries of a unit force of row c of a contact, e_t
likewise of ties, which carry what contacts put on the joints that follow.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.kinematics.joint_wrenches import JointsAsked
from linkwise_runtime.motion.borne_wrenches import OF_WORLD, OWN, axes_frame, joint_numbers
from linkwise_runtime.quantities import AppliedLoad

from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.loads.placed import PlacedLoad, model_pose
from linkwise.analysis.named_bodies import body_frame
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import PASSIVE, REACTION_OF
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.settings import Convention
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

COMPONENTS = range(6)


@dataclass(frozen=True)
class BorneJoint:
    """A joint of the tree, and the axes in which its wrench is told."""

    name: str
    """Name as the user gave it, and as columns show it."""
    joint: str
    axes: str


def borne_joints(texts: Sequence[str], robot: OpenedRobot) -> tuple[BorneJoint, ...]:
    """Return the joints that are written as JOINT or JOINT,AXES.

    Raises LinkwiseError for a joint or a body that does not exist, a joint that is given twice, and for links
    that are energies, those of the back end autograd included.
    """
    twice = [text for text, count in Counter(texts).items() if count > 1]
    if twice:
        raise LinkwiseError(f"--reaction {twice[0]} is given twice; leave one of them out")
    if texts and robot.tree is None:
        raise LinkwiseError(
            f"--reaction {texts[0]}: the links of {robot.name} are energies, which do not say what its joints"
            " carry across their axes; reactions are there for rigid links"
        )
    if texts and robot.backend == "autograd":
        raise LinkwiseError(
            f"--reaction {texts[0]}: autograd has energies of links, which do not say what joints carry"
            " across their axes; leave --backend autograd out"
        )
    return tuple(_borne(text, robot) for text in texts)


def _borne(text: str, robot: OpenedRobot) -> BorneJoint:
    names = robot.tree_joints
    joint, axes = text, OWN
    if text not in names and "," in text:
        joint, axes = text.rsplit(",", 1)
    if joint not in names:
        near = listed(nearest_first(joint, names))
        raise LinkwiseError(f"--reaction {text}: {robot.name} has no joint {joint!r}; its joints are {near}")
    if axes not in (OWN, OF_WORLD):
        axes = body_frame(f"--reaction {text}: not joint, not world, and of bodies", axes, robot).name
    return BorneJoint(text, joint, axes)


@dataclass(frozen=True)
class ReactionShares:
    """Plans and fills the rows of reactions, which follow all others."""

    robot: OpenedRobot
    borne: tuple[BorneJoint, ...]
    loads: tuple[PlacedLoad, ...]
    convention: Convention

    @property
    def places(self) -> Iterator[Place]:
        """Places of the rows, by component: whole, by link, by cause, of gravity, passive, of loads."""
        own = [REACTION_OF[name] for name, field in PASSIVE.items() if self.robot.with_own(field)]
        for number, borne in enumerate(self.borne):
            links, causes = self._loading(borne)
            for part in COMPONENTS:
                at = number, part
                yield "reaction", at
                yield from (("reaction_link", (*at, j)) for j in links)
                yield from (("reaction_qdd", (*at, k)) for k in causes)
                yield from (("reaction_qd", (*at, k)) for k in causes)
                yield from (("reaction_gravity", (*at, j)) for j in links)
                yield from ((name, at) for name in own if self.robot.constraint_rows)
                yield from (("reaction_load", (*at, e)) for e in range(len(self.loads)))

    def fill(
        self,
        out: Array,
        rows: ResultRows,
        standing: Standing | None,
        time: Array,
        motion: tuple[Array, Array, Array],
    ) -> None:
        """Fill the rows of reactions in `out` (rows, S), at q, q̇ and q̈ (S, n) in which ties close."""
        if not self.borne:
            return
        count = len(self.borne)
        found = {name: np.zeros((len(time), count, 6, *tail)) for name, tail in self._tails().items()}
        passed = None if standing is None else self._forces(standing, time, motion)
        for number, borne in enumerate(self.borne):
            shares = self._of_joint(borne, time, motion)
            if standing is not None and passed is not None:
                unit = self._of_contacts(borne, standing, motion[0])
                shares = {name: share + unit @ passed[name] for name, share in shares.items()}
            for name, share in shares.items():
                found[name][:, number] = share.reshape(found[name].shape[:1] + found[name].shape[2:])
        parts = ("reaction_link", "reaction_load")
        total = sum(found[name].sum(-1) for name in parts) + found["reaction_own"].sum(-1)
        rows.put(out, "reaction", total)
        for at, name in enumerate(REACTION_OF.values()):
            rows.put(out, name, found["reaction_own"][..., at])
        if self.convention == "gradient":
            found["reaction_qd"] *= 2.0  # of rigid links
        for name in found.keys() - {"reaction_own"}:
            rows.put(out, name, found[name])

    def _tails(self) -> dict[str, tuple[int, ...]]:
        """Return the last axis of each kind of share."""
        n, links = len(self.robot.joints), len(self.robot.links)
        return {
            "reaction_link": (links,),
            "reaction_qdd": (n,),
            "reaction_qd": (n,),
            "reaction_gravity": (links,),
            "reaction_own": (len(PASSIVE),),
            "reaction_load": (len(self.loads),),
        }

    def _loading(self, borne: BorneJoint) -> tuple[Sequence[int], Sequence[int]]:
        """Return the links and the coordinates that may load a joint: without constraints those behind it."""
        tree, names = self.robot.tree, self.robot.tree_joints
        assert tree is not None  # `borne_joints` has checked it
        if self.robot.constraint_rows:
            return range(len(self.robot.links)), self.robot.driven
        joint = names.index(borne.joint)
        chains = [tree.chain(link.joint) for link in tree.links]
        links = [j for j, chain in enumerate(chains) if joint in chain]
        return links, sorted({tree.joints[f].coordinate for j in links for f in chains[j]})

    def _of_joint(
        self, borne: BorneJoint, time: Array, motion: tuple[Array, Array, Array]
    ) -> dict[str, Array]:
        """Return the shares of one joint without contacts, (S, 6, X) each."""
        model: Any = self.robot.model
        q = motion[0]
        loads = []
        for one in (one for load in self.loads for one in load.wrenches):
            force, moment, place = one.wrench(time, q, model_pose(model))
            loads.append(AppliedLoad(one.acts_on.frame.name, force, moment, at=place))
        found = model.reactions(*motion, axes=borne.axes, joints=[borne.joint], loads=loads)
        acceleration, velocity, gravity, of_loads, passive = (np.asarray(share)[:, 0] for share in found)
        causes = [self._by_joint(share.sum(1)) for share in (acceleration, velocity)]
        counts = np.array([len(load.wrenches) for load in self.loads], np.intp)
        owners = np.repeat(np.eye(len(self.loads)), counts, axis=0)
        shares = {
            "reaction_link": acceleration.sum(2) + velocity.sum(2) + gravity,
            "reaction_qdd": causes[0],
            "reaction_qd": causes[1],
            "reaction_gravity": gravity,
            "reaction_own": passive.sum(2),
            "reaction_load": np.einsum("sxw,xe->sew", of_loads, owners),
        }
        return {name: np.swapaxes(share, 1, 2) for name, share in shares.items()}

    def _by_joint(self, share: Array) -> Array:
        """Return shares (S, causes, 6) in the places of the joints that move by themselves, (S, n, 6)."""
        out = np.zeros((len(share), len(self.robot.joints), 6))
        out[:, list(self.robot.driven)] = share
        return out

    def _forces(
        self, standing: Standing, time: Array, motion: tuple[Array, Array, Array]
    ) -> dict[str, Array]:
        """Return the forces of ties and contacts that contacts cause, (S, C, X) for each kind of share."""
        model: Any = self.robot.model
        q = motion[0]
        acceleration, velocity, gravity = list(model.propagation(*motion))[:3]
        passive = [np.asarray(a) + 0.0 * q for a in model.passive_torque(*motion)]
        pulls = [load.torque(model, time, q) for load in self.loads]
        torques = {
            "reaction_link": acceleration.sum(-1) + velocity.sum(-1) + gravity,
            "reaction_qdd": acceleration.sum(2),
            "reaction_qd": velocity.sum(2),
            "reaction_gravity": gravity,
            "reaction_own": np.stack(passive, -1),
            "reaction_load": np.stack(pulls, -1) if pulls else np.zeros((*q.shape, 0)),
        }
        tied, found = self.robot.constrained, {}
        for name, torque in torques.items():
            reactions = standing.reactions(np.asarray(torque))
            of_ties = np.zeros((len(q), 0, reactions.shape[2]))
            if tied is not None:
                of_ties = -tied.forces_of(q, standing.loads(reactions))
            found[name] = np.concatenate([of_ties, reactions], axis=1)
        return found

    def _of_contacts(self, borne: BorneJoint, standing: Standing, q: Array) -> Array:
        """Return what a joint carries of unit forces of ties, then of contacts, (S, 6, C)."""
        ground, model = self.robot.ground, self.robot.model
        tree = self.robot.package.manifest.tree
        assert tree is not None  # `borne_joints` has checked it
        asked = JointsAsked(joint_numbers(tree, borne.joint), axes_frame(model.backend, borne.axes))
        backend, (at,) = model.door.read({"q": q})
        found = []
        if self.robot.constrained is not None:
            ties = self.robot.constrained.constraints.ties
            found.append(np.asarray(ties.rows(backend).on_joints(asked, at, None))[:, 0])
            couplings = len(ties.chosen.rows) - found[0].shape[1]
            found.append(np.zeros((len(q), couplings, 6)))
        for name, made in zip(ground.names, ground.constraints, strict=True):
            own = [at for at, row in enumerate(made.rows) if row.rpartition(" ")[0] == name]
            found.append(np.asarray(made.ties.rows(backend).on_joints(asked, at, None))[:, 0][:, own])
        return np.swapaxes(np.concatenate(found, axis=1), 1, 2)
