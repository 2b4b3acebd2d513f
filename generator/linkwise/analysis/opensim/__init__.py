"""OpenSim's induced acceleration analysis: its setup files are read, and its storage files are written."""
