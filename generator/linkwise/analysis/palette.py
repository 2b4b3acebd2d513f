"""Colours that colour-blind readers tell apart, the same in figures and on the page."""

# Okabe and Ito 2008, the first three in the paper's order of red, blue and green; its yellow is too
# pale on white, so a brown stands in its place.
COLOURS = (
    "#D55E00",
    "#0072B2",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#8C6D31",
)
ON_DARK = ("#FF8B3D", "#3D9BE0", "#2ECC9B", "#E59AC7", "#F5B942", "#9BDCFF", "#C9A66B")
"""The same, light enough for a dark page."""

GRAVITY = "#7F7F7F"
DASHES = ("solid", "dashed", "dotted", "dashdot")


def colour(index: int) -> str:
    """Colour of the index-th joint, link or cause."""
    return COLOURS[index % len(COLOURS)]


def dash(index: int) -> str:
    """Line style, for the indices that share a colour."""
    return DASHES[index // len(COLOURS) % len(DASHES)]
