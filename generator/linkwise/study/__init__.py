"""Studies: many recordings, run by many processes or machines, and their combined results."""

from linkwise.study.process_pool import ProcessPool
from linkwise.study.ray_cluster import RayCluster
from linkwise.study.run import StudyOutcome, run_study

__all__ = ["ProcessPool", "RayCluster", "StudyOutcome", "run_study"]
