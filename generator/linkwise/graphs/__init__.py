"""Autograd's graphs of partial torques, overlaid, as pictures, tables and files.

A generated package records them (`Dynamics.graph`); here `overlay` joins the graphs of several parts,
`graph_summary` counts them, `graph_files` writes and draws them.
"""

from linkwise.graphs.dot_text import dot_text
from linkwise.graphs.folding import FOLDS, folded
from linkwise.graphs.graph_files import FORMATS, graph_files, graph_json, recorded_files
from linkwise.graphs.overlay import Overlay, graph_summary, overlay, part_label, recorded_summary

__all__ = [
    "FOLDS",
    "FORMATS",
    "Overlay",
    "dot_text",
    "folded",
    "graph_files",
    "graph_json",
    "graph_summary",
    "overlay",
    "part_label",
    "recorded_files",
    "recorded_summary",
]
