"""Answers made from packed values: spread, summed over links, solved for accelerations."""
