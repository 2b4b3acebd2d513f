"""The page's template and the data in it."""

import base64
import gzip
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise.analysis import analyze
from linkwise.analysis.show.page import TEMPLATE, page_data, report, view
from linkwise.render import variables
from plotly.offline import get_plotlyjs

EVIL = '</script><script>alert("1")</script>&<!--'


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return analyze(write_csv(tmp_path_factory.mktemp("a") / "a.csv", smooth(80, 3)), PLANAR3)


def unpacked(html: str, name: str) -> str:
    block = re.search(rf'<script type="application/gzip" id="{name}">(.*?)</script>', html, re.S)
    return gzip.decompress(base64.b64decode(block[1])).decode()


def test_template_and_view_agree(analysis):
    assert variables(TEMPLATE) == set(view(analysis))


def test_numbers_are_the_tables_to_the_last_bit(analysis):
    data = json.loads(page_data(analysis))
    values = np.frombuffer(base64.b64decode(data["values"]), "<f8")
    shown = [at for at, c in enumerate(analysis.columns) if not c.quantity.startswith("power")]
    assert [c["name"] for c in data["columns"]] == [analysis.columns[at].name for at in shown]
    np.testing.assert_array_equal(values.reshape(len(shown), -1), analysis.values[shown])
    work = np.zeros((2, 3, 3))
    for entry in data["work"]:
        work[:, entry["i"], entry["j"]] = entry["given"], entry["taken"]
    np.testing.assert_array_equal(work, [analysis.work.given, analysis.work.taken])
    origins = np.frombuffer(base64.b64decode(data["bodies"]["origins"]), "<f8")
    assert origins.shape == (80 * 3 * 3,)
    assert data["bodies"]["up"] == [0, 9.80665, 0]
    assert [data["bodies"][key] for key in ("parents", "links", "coordinates")] == [
        [-1, 0, 1],
        [0, 1, 2],
        [0, 1, 2],
    ]


def test_names_cannot_end_their_element(analysis):
    robot = replace(analysis.robot, name=EVIL, joints=(EVIL, "b", "c"), links=("a", EVIL, "c"))
    html = report(replace(analysis, robot=robot, source=EVIL))
    assert EVIL not in html
    assert "alert(" not in html.replace('alert(\\"1', "").replace("alert(&quot;1", "")
    data = json.loads(unpacked(html, "data"))
    assert (data["robot"], data["joints"][0]["name"], data["links"][1]) == (EVIL, EVIL, EVIL)


def test_page_is_one_file(analysis):
    html = report(analysis)
    head = html[: html.index('id="data"')]
    assert not re.search(r"(src|href)=", head)
    assert "default-src 'none'" in head


def test_a_small_logs_page_is_small_and_has_the_whole_library_with_its_licence(analysis):
    html = report(analysis)
    script = get_plotlyjs()
    assert unpacked(html, "plotly") == script
    assert len(html) < 0.45 * len(script)
    notice = re.search("<!-- (.*?) -->", html)[1]
    assert re.fullmatch(r"plotly.js v[\d.]+ Copyright .* Licensed under the MIT license", notice)


def test_robot_without_geometry(analysis):
    robot = replace(analysis.robot, tree=None)
    assert json.loads(page_data(replace(analysis, robot=robot)))["bodies"] is None
