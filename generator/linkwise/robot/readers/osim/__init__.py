"""Readers of OpenSim models."""
