"""Style of every plot: legible on paper, in grey and to the colour-blind; the same on each run."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal, get_args

import numpy as np

from linkwise.escape import printable, short
from linkwise.extras import extra

# Okabe and Ito 2008, the first three in the paper's order of red, blue and green; their yellow is too pale
# on white, so a brown stands in its place.
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D31")
VERMILION, BLUE, GREEN, PURPLE, _, SKY, BROWN = COLOURS
ON_DARK = ("#FF8B3D", "#3D9BE0", "#2ECC9B", "#E59AC7", "#F5B942", "#9BDCFF", "#C9A66B")
"""Colours like COLOURS, light enough for a dark page."""

GRAVITY = "#7F7F7F"
INK, PALE = "#222222", "#E0E3E7"
DASHES = ("solid", "dashed", "dotted", "dashdot")

SETTINGS = {
    "svg.hashsalt": "linkwise",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # fonts as they are, which every program can edit
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "text.parse_math": False,  # a joint may be called a$b
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.handlelength": 4.5,
    "lines.linewidth": 1.6,
    "figure.dpi": 100,
}


def colour(index: int) -> str:
    """Return the colour of the index-th joint, link or cause."""
    return COLOURS[index % len(COLOURS)]


def tone(index: int) -> str:
    """Return the colour of an area, which has no dashes: darker where the colours begin again, then paler."""
    toward, much = ((0, 0.0), (0, 0.45), (255, 0.45))[index // len(COLOURS) % 3]
    parts = (int(colour(index)[at : at + 2], 16) for at in (1, 3, 5))
    return "#" + "".join(f"{round(part * (1 - much) + toward * much):02X}" for part in parts)


def dash(index: int) -> str:
    """Return the line style, which differs for the indices that share a colour."""
    return DASHES[index // len(COLOURS) % len(DASHES)]


def drawn(name: str, most: int = 24) -> str:
    """Return a name as a plot shows it: literally, with escapes for what the font lacks, at most so long.

    One that begins with _, which hides a line from legends, begins with a blank that nobody sees.
    """
    manager = extra("matplotlib.font_manager")
    pictures = manager.get_font(manager.findfont(SETTINGS["font.family"])).get_charmap()
    text = short(printable(name, lambda c: c.isprintable() and ord(c) in pictures), most)
    return f"\N{ZERO WIDTH SPACE}{text}" if text.startswith("_") else text


@contextmanager
def styled() -> Iterator[Any]:
    """Yield matplotlib in this style, whatever the user's own settings are."""
    matplotlib = extra("matplotlib")
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(SETTINGS)
        yield matplotlib


FigureFormat = Literal["svg", "pdf", "eps", "png"]
FORMATS: tuple[FigureFormat, ...] = get_args(FigureFormat)


def saved(figure: Any, kind: FigureFormat, dpi: int = 200) -> bytes:
    """Return the bytes of a figure.

    They have no date or program, which would make runs differ. EPS has no transparency, so that in it what is
    pale is made opaque, and hides what is behind.
    """
    out = io.BytesIO()
    nameless: dict[str, dict[str, str | None]] = {
        "svg": {"Date": None, "Creator": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
        "eps": {"Creator": "linkwise"},
        "png": {"Software": None},
    }
    if kind == "eps":
        _make_opaque(figure)
    figure.savefig(out, format=kind, dpi=dpi, metadata=nameless[kind])
    return re.sub(rb"(?m)^%%CreationDate:.*\n", b"", out.getvalue()) if kind == "eps" else out.getvalue()


def _make_opaque(figure: Any) -> None:
    """Mix the colours of what is transparent with white."""
    colors = extra("matplotlib.colors")
    for artist in figure.findobj(lambda one: one.get_alpha() not in (None, 1.0)):
        alpha = artist.get_alpha()
        artist.set_alpha(None)
        for part in ("color", "facecolor"):
            if hasattr(artist, f"get_{part}"):
                drawn_in = colors.to_rgba_array(getattr(artist, f"get_{part}")())
                visible = drawn_in[:, 3:] > 0.0
                pale = 1.0 - alpha * (1.0 - drawn_in[:, :3])
                getattr(artist, f"set_{part}")(np.hstack([pale, visible]))
                break
