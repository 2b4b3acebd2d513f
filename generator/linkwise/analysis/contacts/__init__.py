"""Contacts with the ground in a movement: their forces, found from the equations of unactuated joints."""

from linkwise.analysis.contacts.given_contacts import Contacts, WhileColumn

__all__ = ["Contacts", "WhileColumn"]
