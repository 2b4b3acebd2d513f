"""Files and folders that appear whole or not at all: the one writer of packages, reports and analyses.

A writer works in a hidden folder beside its target, `workplace`, which it holds locked while it lives; the
result is put in place by one step of the file system, `exchange`. After a kill at any moment the old target
or the new one is there whole, and the next run of linkwise there removes what the dead one left. Libraries
replace single files so, none a folder, nor one on systems that cannot exchange two names, such as Windows.
"""

from linkwise.output.workplace import passing_folder, sweep
from linkwise.output.writer import refuse_unless_folder, require_writable, whole_directory, write_files

__all__ = [
    "passing_folder",
    "refuse_unless_folder",
    "require_writable",
    "sweep",
    "whole_directory",
    "write_files",
]
