"""What generated packages import: a robot's structure, its calls and the back ends that compute them.

It needs NumPy, and torch for back ends that compute with tensors; what differs from robot to robot comes in
as arguments.
"""
