"""The text of what linkwise emits, in Jinja2: one template a file, named after it."""
