"""Readers of CSV, OpenSim storage and Parquet, and what they refuse."""

import errno
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.motion_logs import JOINTS, smooth, write_csv, write_mot
from linkwise.analysis.logs import open_log, text
from linkwise.errors import LinkwiseError


def whole(path: Path, columns: tuple[int, ...], rows: int = 1000) -> np.ndarray:
    return np.concatenate([block for block, _ in open_log(path).read(columns, rows)])


def test_csv_reads_back_exactly_whatever_the_block(tmp_path):
    table = smooth(50, 3)
    path = write_csv(tmp_path / "a.csv", table)
    np.testing.assert_array_equal(whole(path, (0, 1, 2, 3)), table)
    np.testing.assert_array_equal(whole(path, (0, 3, 1), rows=7), table[:, [0, 3, 1]])


@pytest.mark.parametrize("mark", [";", "\t", ",", ", "])
def test_csv_takes_the_delimiter_of_its_header(tmp_path, mark):
    path = tmp_path / "a.csv"
    text = f'\ufefftime{mark}"left, knee"\r\n0{mark}1.5\r\n\n'
    path.write_text(text, encoding="utf-8", newline="")
    assert open_log(path).columns == ("time", "left, knee")
    np.testing.assert_array_equal(whole(path, (0, 1)), [[0, 1.5]])


def test_empty_cells_at_the_end_and_quoted_delimiters_are_not_more_columns(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('time,a,note\n0,1,"x, y"\n0.1,2,z,\n', encoding="utf-8")
    np.testing.assert_array_equal(whole(path, (0, 1)), [[0, 1], [0.1, 2]])


def test_opensim_storage(tmp_path):
    table = np.round(smooth(9, 2), 8)
    path = write_mot(tmp_path / "a.mot", table, ("hip", "knee"))
    log = open_log(path)
    assert (log.columns, log.degrees, log.first_row) == (("time", "hip", "knee"), True, 11)
    np.testing.assert_array_equal(whole(path, (0, 1, 2)), table)
    write_mot(tmp_path / "b.sto", table, ("hip", "knee"), inDegrees="no")
    assert open_log(tmp_path / "b.sto").degrees is False


def test_parquet(tmp_path):
    table = smooth(30, 2)
    arrays = dict(zip(("time", "a", "b"), table.T.copy(), strict=True))
    pq.write_table(pa.table(arrays), tmp_path / "a.parquet")
    np.testing.assert_array_equal(whole(tmp_path / "a.parquet", (2, 0)), table[:, [2, 0]])
    arrays["b"] = pa.array([None] + [1] * 29)
    pq.write_table(pa.table(arrays), tmp_path / "b.parquet")
    assert np.isnan(whole(tmp_path / "b.parquet", (2,))[0, 0])


def test_size_is_reached(tmp_path):
    log = open_log(write_csv(tmp_path / "a.csv", smooth(10, 3)))
    done = [at for _, at in log.read((0, 1), rows=4)]
    assert done == sorted(done)
    assert done[-1] == log.size


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["0,1,2,3", "0.1,1,x,3"], r"row 3, column 'joint2': 'x' is not a number"),
        (["0,1,2,3", "0.1,1,,3"], r"row 3, column 'joint2': empty; fill the gap"),
        (["0,1,2,3", "0.1,1"], r"row 3: 2 cells where the header names 4; the file is cut off"),
        (["0,1,2,3", "", "0.1,1,2,3"], r"row 3: blank row"),
        (["0,1,2,3", "0,1,1,5,2,3"], r"row 3: 6 cells where the header names 4; is there a comma"),
    ],
)
def test_faulty_cells_are_named_by_row_and_column(tmp_path, lines, message):
    path = tmp_path / "a.csv"
    path.write_text("\n".join([",".join(["time", *JOINTS]), *lines]) + "\n", encoding="utf-8")
    with pytest.raises(LinkwiseError, match=message):
        whole(path, (0, 1, 2, 3))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "row 1: no header"),
        ("0,1\n1,2\n", "row 1 holds numbers; put a header"),
    ],
)
def test_missing_header(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(LinkwiseError, match=message):
        open_log(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("fact", "lie", "message"),
    [
        (
            "nColumns=2",
            "nColumns=4\nnColumns=2",
            r"row 5: the header says nColumns twice, '4' before, '2' here",
        ),
        (
            "inDegrees=yes",
            "inDegrees=no\ninDegrees=yes",
            "the header says inDegrees twice, 'no' before, 'yes' here",
        ),
    ],
)
def test_headers_of_simm_and_headers_that_say_two_things_are_held_to_them(
    tmp_path: Path, fact: str, lie: str, message: str
) -> None:
    path = write_mot(tmp_path / "a.mot", smooth(5, 1), ("hip",))
    path.write_text(path.read_text().replace(fact, lie))
    with pytest.raises(LinkwiseError, match=message):
        list(open_log(path).read((0, 1)))


@pytest.mark.parametrize(
    ("fact", "lie", "told"),
    [
        ("nRows=5", "nRows=9", "the header promises nRows=9, and 5 rows follow: is the file cut off?"),
        ("nRows=5", "datarows 4", "the header promises nRows=4, and 5 rows follow, which all count"),
        (
            "nColumns=2",
            "datacolumns 4",
            "the header promises nColumns=4, and 2 columns have names, which count",
        ),
    ],
)
def test_counts_of_a_header_that_lie_are_told(tmp_path: Path, fact: str, lie: str, told: str) -> None:
    path = write_mot(tmp_path / "a.mot", smooth(5, 1), ("hip",))
    expected = whole(path, (0, 1))
    path.write_text(path.read_text().replace(fact, lie) + "\n\n")
    assert open_log(path).warnings == (told,)
    np.testing.assert_array_equal(whole(path, (0, 1)), expected)


def test_cut_off_files(tmp_path):
    path = tmp_path / "a.mot"
    path.write_text("Coordinates\nnRows=3\n", encoding="utf-8")
    with pytest.raises(LinkwiseError, match="no line 'endheader'"):
        open_log(path)
    pq.write_table(pa.table({"time": [0.0, 1.0]}), tmp_path / "a.parquet")
    data = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "a.parquet").write_bytes(data[:-20])
    with pytest.raises(LinkwiseError, match="not Parquet, or cut off"):
        open_log(tmp_path / "a.parquet")


def test_other_files(tmp_path):
    (tmp_path / "a.xlsx").write_bytes(b"")
    with pytest.raises(LinkwiseError, match="unknown suffix; give a"):
        open_log(tmp_path / "a.xlsx")
    with pytest.raises(LinkwiseError, match="no such file"):
        open_log(tmp_path / "b.csv")
    (tmp_path / "a.csv").write_bytes(b"time,\xff\n")
    with pytest.raises(LinkwiseError, match="not UTF-8"):
        open_log(tmp_path / "a.csv")


def test_a_decimal_comma_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time;joint1\n0;1\n0,01;2\n", encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"row 3, column 'time': '0,01' has a decimal comma"):
        whole(path, (0, 1))


DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "a.mot",
            f"nRows={DIGITS}\nendheader\ntime\n0\n",
            "nRows='9+…9+' in the header is",
        ),
        ("a.csv", f"time,{'x' * 140_000}\n", r"row 1: cannot be read as separated values: field larger"),
        ("a.csv", "x" * 17_000_000, r"row 1 has more than 16,777,216 characters; is it a log\?"),
        ("a.mot", "a=b\n" * 20_000, "no line 'endheader'"),
        ("a.csv", "t\0i\0m\0e\0,\0a\0", "row 1: zero bytes among the column names; save it as UTF-8"),
        ("a.parquet", "PAR1" + "x" * 99 + "PAR1", "not Parquet, or cut off"),
    ],
    ids=["digits", "field", "line", "header", "zero bytes", "parquet"],
)
def test_no_header_is_taken_that_no_log_has(tmp_path, name, content, message):
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(LinkwiseError, match=message):
        open_log(tmp_path / name)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        ("\0", r"row 3, column 'a': '\\x00' is not a number"),
        ("1_000", "'1_000' is not a number"),
        ("１", "'１' is not a number"),
        (f"x{DIGITS}", "'x9+…9+' is not a number"),
    ],
)
def test_cells_that_python_alone_would_read_are_named(tmp_path, cell, message):
    path = tmp_path / "a.csv"
    path.write_text(f"time,a\n0,1\n0.1,{cell}\n", encoding="utf-8")
    with pytest.raises(LinkwiseError, match=message):
        whole(path, (0, 1))


def test_numbers_of_many_digits_are_numbers(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(f"time,a\n0,0.{DIGITS}\n", encoding="utf-8")
    np.testing.assert_array_equal(whole(path, (0, 1)), [[0, 1.0]])


@pytest.mark.parametrize("rows", [1, 2, 3, 1000])
def test_blank_rows_are_found_wherever_a_block_ends(tmp_path, rows):
    path = tmp_path / "a.csv"
    path.write_text("time,a\n0,1\n\n\n1,2\n", encoding="utf-8")
    with pytest.raises(LinkwiseError, match="row 3: blank row"):
        whole(path, (0, 1), rows)
    path.write_text("time,a\n0,1\n1,2\n\n\n\n\n", encoding="utf-8")
    np.testing.assert_array_equal(whole(path, (0, 1), rows), [[0, 1], [1, 2]])


def test_long_rows_come_in_small_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "LONGEST", 100)
    path = write_csv(tmp_path / "a.csv", smooth(50, 3))
    blocks = [block for block, _ in open_log(path).read((0, 1, 2, 3))]
    assert max(map(len, blocks)) <= 3
    np.testing.assert_array_equal(np.concatenate(blocks), smooth(50, 3))


@pytest.mark.parametrize(("name", "before"), [("a.csv", ""), ("a.mot", ""), ("a.mot", "nRows=1\n")])
def test_a_line_without_an_end_is_named_by_its_row(tmp_path, monkeypatch, name, before):
    monkeypatch.setattr(text, "LONGEST", 100)
    path = tmp_path / name
    path.write_text(before + "x" * 101, encoding="utf-8")
    row = 1 + before.count("\n")
    with pytest.raises(LinkwiseError, match=rf"{name}: row {row} has more than 100 characters; is it"):
        open_log(path)


def test_a_damaged_page_of_parquet_is_named(tmp_path):
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"time": np.random.default_rng(1).random(9000)}), path, use_dictionary=False)
    data = bytearray(path.read_bytes())
    data[4:3000] = b"\0" * 2996
    path.write_bytes(data)
    with pytest.raises(LinkwiseError, match=r"a\.parquet: after row 0: damaged \(.*\); write the file again"):
        whole(path, (0,))


def test_a_log_that_may_not_be_read_is_named(tmp_path, monkeypatch):
    path = write_csv(tmp_path / "a.csv", smooth(5, 1), ("a",))

    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "open", refuse)  # whoever runs the tests may read everything
    with pytest.raises(LinkwiseError, match=r"a\.csv: cannot be read: Permission denied"):
        open_log(path)
