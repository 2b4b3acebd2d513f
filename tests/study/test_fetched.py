"""Data fetched of an address are bounded, whatever its server sends."""

from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from helpers.studies import HEAD, Here, write_study
from linkwise import LinkwiseError
from linkwise.study import paths, run_study
from linkwise.study.paths import opened_here

PART = b"#" * (1 << 16)
ALL = 64 << 20
"""Bytes that are sent if nobody ends it."""


class Flood(ThreadingHTTPServer):
    """A server that sends far more than it says: as much as its path begins with, or nothing."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Sender)
        self.sent = 0


class Sender(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Flood

    def log_message(self, *_: object) -> None:
        pass

    def do_HEAD(self) -> None:
        said = self.path.strip("/").partition("/")[0]
        self.send_response(200)
        if said.isdigit():
            self.send_header("Content-Length", said)
        self.end_headers()

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Transfer-Encoding", "chunked")
        self.end_headers()
        with suppress(OSError):
            for _ in range(ALL // len(PART)):
                self.wfile.write(b"%x\r\n%s\r\n" % (len(PART), PART))
                self.server.sent += len(PART)
            self.wfile.write(b"0\r\n\r\n")


@pytest.fixture
def flood() -> Iterator[Flood]:
    pytest.importorskip("aiohttp")
    with Flood() as server:
        Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server
        server.shutdown()


@pytest.mark.parametrize(("name", "most"), [("arm.toml", 1), ("9/arm.toml", 1), ("arm.urdf", 4)])
def test_of_a_robot_no_more_is_fetched_than_its_file_may_have(
    name: str, most: int, flood: Flood, tmp_path: Path
) -> None:
    address = f"http://127.0.0.1:{flood.server_port}/{name}"
    trial = f'[[trial]]\nname = "a"\nlog = "data/S1/slow_1.csv"\nrobot = "{address}"\ncondition = "x"\n'
    file = write_study(tmp_path, HEAD, trial, subjects=1, trials=1)
    said = "more comes than 9 bytes" if name.startswith("9") else f"the file is larger than {most} MiB"
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, tmp_path / "out", Here())
    assert str(caught.value).startswith(f"{file}: trial 'a': {address}: {said}")
    assert flood.sent < ALL / 2


def test_a_robot_that_is_said_to_be_too_large_is_not_fetched(flood: Flood) -> None:
    address = f"http://127.0.0.1:{flood.server_port}/{1 << 30}/arm.toml"
    with pytest.raises(LinkwiseError, match="the file is larger than 1 MiB"), opened_here(address, 1 << 20):
        pass
    assert flood.sent == 0


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("100/a.csv", "more comes than 100 bytes, as the store says it has; fetch it yourself"),
        ("a.csv", "more comes than 1,000,000 bytes; fetch it yourself, and name your copy"),
    ],
)
def test_of_a_log_no_more_is_fetched_than_its_store_says(
    name: str, told: str, flood: Flood, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paths, "UNSAID", 1_000_000)
    address = f"http://127.0.0.1:{flood.server_port}/{name}"
    with pytest.raises(LinkwiseError) as caught, opened_here(address):
        pass
    assert str(caught.value).startswith(f"{address}: {told}")
    assert flood.sent < ALL / 2


def test_a_file_of_the_size_that_is_said_is_fetched(flood: Flood) -> None:
    with opened_here(f"http://127.0.0.1:{flood.server_port}/{ALL}/a.csv") as copy:
        assert copy.stat().st_size == ALL


class Silent:
    """A store that calls nothing back while it sends."""

    def info(self, _: str) -> dict[str, object]:
        return {"type": "file", "size": 10}

    def get_file(self, _: str, copy: str, **__: object) -> None:
        Path(copy).write_bytes(bytes(11))


def test_what_a_store_sends_without_a_word_is_counted_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paths, "_system", lambda path: (Silent(), path))
    told = "more comes than 10 bytes, as the store says it has"
    with pytest.raises(LinkwiseError, match=told), opened_here("s3://lab/a.csv"):
        pass
