"""Runtime that generated packages import: a robot's structure, its calls and the back ends that compute them.

It needs NumPy, and torch for the back ends that compute with tensors; whatever differs from robot to robot is
passed in as arguments.
"""
