"""Studies: many recordings, done by many processes or machines, and what they say together."""

from linkwise.study.process_pool import ProcessPool
from linkwise.study.ray_cluster import RayCluster
from linkwise.study.study_run import StudyOutcome, run_study

__all__ = ["ProcessPool", "RayCluster", "StudyOutcome", "run_study"]
