"""Names that fit beside a curve."""


def short(name: str, most: int = 24) -> str:
    """The name, its middle left out where it is longer than `most`: exporters number names at their end."""
    if len(name) <= most:
        return name
    tail = (most - 1) // 2
    return f"{name[: most - 1 - tail]}…{name[-tail:]}"
