"""What moves a robot, source by source, and how it then moves over time."""
