"""A robot on contacts: the joints that nothing drives, and the joints that contacts load."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.constraints.held_frames import ground_normal
from linkwise_runtime.constraints.independent_joints import loose_base
from linkwise_runtime.quantities import Contact

from linkwise.analysis.contacts import Contacts
from linkwise.analysis.contacts.ground import GroundContacts
from linkwise.analysis.contacts.pressed import PRESSED
from linkwise.analysis.loads.placed import moving_joints
from linkwise.analysis.named_bodies import body_frame
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.errors import LinkwiseError
from linkwise.escape import listed


def with_contacts(robot: OpenedRobot, contacts: Contacts) -> OpenedRobot:
    """Return the robot with contacts.

    Without contacts, only what nothing drives is as it is said there.

    Raises LinkwiseError for frames that do not exist or stand on the ground, contacts that leave nothing to
    move, two contacts of one name, and a robot of which every joint is driven.
    """
    if not contacts.given:
        said = contacts.unactuated
        return replace(robot, undriven=_said(robot, said)) if said else robot
    tree = robot.package.manifest.tree
    first = contacts.given[0]
    if tree is None:
        raise LinkwiseError(
            f"contact on {first.frame!r}: the links of {robot.name} are energies, which do not say where"
            " anything is; contacts are for rigid links"
        )
    frames = [body_frame("contact on", str(contact.frame), robot) for contact in contacts.given]
    names = [contact.name or str(contact.frame) for contact in contacts.given]
    _check_names(names, contacts)
    unactuated = _unactuated(robot, contacts.unactuated)
    given = tuple(_named(robot, contact) for contact in contacts.given)
    made = tuple(_constraints(robot, contact) for contact in given)
    loaded = robot.joints_supporting({i for frame in frames for i in moving_joints(tree, frame.joint)})
    ground = GroundContacts(
        tuple(names),
        given,
        made,
        unactuated,
        tuple(sorted({*loaded, *unactuated})),
        robot.constrained,
    )
    return replace(robot, contacts=ground)


def _unactuated(robot: OpenedRobot, given: Sequence[str]) -> tuple[int, ...]:
    """Return the joints that nothing drives: those given, or those of the floating base."""
    model: Any = robot.model
    base = _said(robot, given) if given else loose_base(model.backend.tree)
    found = tuple(sorted({i for i in base if i in robot.driven}))
    if not found:
        raise LinkwiseError(
            f"{robot.name} has no floating base, and every joint is driven: its motion does not tell what a"
            " contact bears; measure that and give it with --loads, or name the joints that nothing drives"
            " with --unactuated"
        )
    return found


NONE = "none"
"""Word for no joint, where a joint that nothing drives is asked for."""


def _said(robot: OpenedRobot, given: Sequence[str]) -> tuple[int, ...]:
    """Return the joints of these names; raise LinkwiseError for one that has no torque."""
    if tuple(given) == (NONE,) and NONE not in robot.joints:
        return ()
    for name in given:
        if name not in robot.driven_joints:
            raise LinkwiseError(
                f"--unactuated {name}: {robot.name} has no such joint that moves by itself; they are"
                f" {listed(nearest_first(name, robot.driven_joints))}, or {NONE}"
            )
    return tuple(robot.joints.index(name) for name in given)


def _named(robot: OpenedRobot, contact: Contact) -> Contact:
    """Return the contact with its name, and the ground's normal if it counts: given, or against gravity."""
    tree = robot.package.manifest.tree
    gravity = (0.0, 0.0, 0.0) if tree is None else tree.gravity
    name = contact.name or str(contact.frame)
    if contact.kind not in ("rolling", *PRESSED):
        return contact._replace(name=name)
    try:
        return contact._replace(name=name, normal=ground_normal(contact, f"contact {name!r}", gravity))
    except ValueError as error:
        raise LinkwiseError(str(error)) from None


def _constraints(robot: OpenedRobot, contact: Contact) -> Any:
    model: Any = robot.model
    held = contact._replace(kind="held") if contact.kind in PRESSED else contact
    try:
        return model.constrained(contacts=[held])
    except (TypeError, ValueError) as error:
        told = str(error).replace("contacts[0]", f"contact {contact.name!r}")
        told = told.replace("give it a name=", "give it another, as NAME:FRAME")
        if "over-constrained" in told:
            told += "; hold less of it, at a point say"
        raise LinkwiseError(f"--contact: {told}") from None


def _check_names(names: Sequence[str], contacts: Contacts) -> None:
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise LinkwiseError(f"contact {twice[0]!r} stands twice; tell them apart as NAME:FRAME")
    strange = [name for name in contacts.columns if name not in names]
    if strange:
        near = listed(nearest_first(strange[0], names))
        raise LinkwiseError(f"--contact-while {strange[0]}=…: there is no such contact; they are {near}")
