"""What is the same in every generated package: its structure, its calls and its back ends.

These files are copied as they are into each package, as `NAME/runtime/`. They need NumPy or torch and one
another, nothing else; what differs from robot to robot comes in as arguments.
"""
