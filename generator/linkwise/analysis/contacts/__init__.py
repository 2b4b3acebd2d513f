"""Contacts with the ground in a movement: what they bear, found by the equations of what nothing drives."""

from linkwise.analysis.contacts.given_contacts import Contacts, WhileColumn

__all__ = ["Contacts", "WhileColumn"]
