"""AlexNet's weights are downloaded whole, or not at all; without a network in one line."""

import hashlib
import socket
import threading
from collections.abc import Iterator
from functools import partial
from http.server import HTTPServer, SimpleHTTPRequestHandler
from pathlib import Path

import pytest
import torch

from ngi.evaluate import lpips_download
from ngi.evaluate.lpips_metric import cached_weights

CONTENT = bytes(range(256)) * 1000


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


class CutOff(Quiet):
    """Says that there is more than comes."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", str(len(CONTENT)))
        self.end_headers()
        self.wfile.write(CONTENT[:1000])


@pytest.fixture
def served(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[str]:
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "weights.pth").write_bytes(CONTENT)
    handler = partial(getattr(request, "param", Quiet), directory=str(folder))
    server = HTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/weights.pth"
    server.shutdown()
    server.server_close()


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path / "hub"))
    monkeypatch.delenv("NGI_LPIPS_WEIGHTS", raising=False)


def told(monkeypatch, capsys, *, url: str, sha256: str) -> tuple[int, list[str]]:
    monkeypatch.setattr(lpips_download, "_url", lambda: url)
    monkeypatch.setattr(lpips_download, "SHA256", sha256)
    status = lpips_download.main()
    return status, capsys.readouterr().out.splitlines()


def test_they_come_where_lpips_looks_for_them(served, monkeypatch, capsys) -> None:
    sha256 = hashlib.sha256(CONTENT).hexdigest()
    status, lines = told(monkeypatch, capsys, url=served, sha256=sha256)
    assert status == 0
    assert len(lines) == 1
    assert "244 MB" in lines[0]
    assert cached_weights().read_bytes() == CONTENT
    status, (line,) = told(monkeypatch, capsys, url="none is asked", sha256="")
    assert status == 0
    assert line.endswith(f"are in {cached_weights()}")
    assert socket.getdefaulttimeout() is None


@pytest.mark.parametrize(
    ("served", "sha256"),
    [(Quiet, "0" * 64), (CutOff, hashlib.sha256(CONTENT).hexdigest())],
    indirect=["served"],
)
def test_others_and_parts_of_them_are_not_kept(served, sha256, monkeypatch, capsys) -> None:
    status, lines = told(monkeypatch, capsys, url=served, sha256=sha256)
    assert status == 1
    assert "so its column stays empty" in lines[1]
    assert list(cached_weights().parent.iterdir()) == []


def test_without_a_network_one_line_says_so(monkeypatch, capsys) -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # and does not listen
        url = f"http://127.0.0.1:{nobody.getsockname()[1]}/weights.pth"
        status, lines = told(monkeypatch, capsys, url=url, sha256="")
    assert status == 1
    assert len(lines) == 2
    assert "so its column stays empty" in lines[1]


def test_weights_of_ones_own_are_left_alone(monkeypatch, capsys, tmp_path) -> None:
    own = tmp_path / "weights.pth"
    monkeypatch.setenv("NGI_LPIPS_WEIGHTS", str(own))
    status, (line,) = told(monkeypatch, capsys, url="none is asked", sha256="")
    assert status == 1
    assert line.endswith(f"{own}: no such file; correct or unset it")
    own.write_bytes(b"mine")
    status, (line,) = told(monkeypatch, capsys, url="none is asked", sha256="")
    assert status == 0
    assert line.endswith(f"NGI_LPIPS_WEIGHTS={own}")


def test_the_file_is_the_one_that_torchvision_means() -> None:
    name = lpips_download._url().rpartition("/")[2]
    assert name == cached_weights().name
    assert lpips_download.SHA256.startswith(name.removesuffix(".pth").rpartition("-")[2])
