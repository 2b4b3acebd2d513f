"""`report.html`: the analysis as one file that needs no network."""

from linkwise.analysis.extras import extra
from linkwise.analysis.page_data import page_data
from linkwise.analysis.result import Analysis
from linkwise.emit.render import render

NUMBERS, SAMPLES = 500_000, 1500
"""What a page holds at most; longer logs are thinned out, and the page says so."""

TEMPLATE = "motion/report.html.j2"


def report(analysis: Analysis) -> str:
    """HTML of the page for an analysis already thinned to what a page can hold."""
    return render(TEMPLATE, view(analysis))


def view(analysis: Analysis) -> dict[str, str]:
    """What the template needs: a title (escaped there), the data, and plotly's script."""
    return {
        "title": f"{analysis.robot.name} · {analysis.source}",
        "data": page_data(analysis),
        "plotly": extra("plotly.offline").get_plotlyjs(),
    }
