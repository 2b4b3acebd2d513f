"""What each source accelerates: actuators, velocities, weights, loads and constraints."""
