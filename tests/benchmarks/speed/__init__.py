"""Parts of bench_speed.py: what is timed, and against what."""
