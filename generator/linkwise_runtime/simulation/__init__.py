"""How a robot moves under torques and loads: its equations of motion over time, and their energy."""
