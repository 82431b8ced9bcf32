"""No page of another origin can drive the viewer."""

import socket
from collections.abc import Iterator
from contextlib import closing
from threading import Event
from urllib.parse import urlsplit

import pytest

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

import msgspec  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402
from websockets.sync.client import connect  # noqa: E402
from websockets.typing import Origin, Subprotocol  # noqa: E402

from ngi.view.page import Page, address, is_own_page, viser_server  # noqa: E402
from tests.view.browser import studio, subject  # noqa: E402


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    server = viser_server(host="127.0.0.1", port=0)
    yield server.get_port()
    server.stop()


def opened(port: int, origin: str | None) -> bool:
    try:
        with connect(
            f"ws://127.0.0.1:{port}",
            origin=None if origin is None else Origin(origin),
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        ):
            return True
    except InvalidStatus as refusal:
        return refusal.response.status_code != 403


def test_pages_of_other_origins_are_refused(port: int) -> None:
    assert not opened(port, "https://elsewhere.example")
    assert not opened(port, f"http://127.0.0.1:{port + 1}")
    assert not opened(port, "null")


def test_its_own_page_and_programs_are_let_in(port: int) -> None:
    assert opened(port, f"http://127.0.0.1:{port}")
    assert opened(port, None)


def test_no_browser_can_have_it_shared_with_a_public_host(
    monkeypatch: pytest.MonkeyPatch, port: int
) -> None:
    tunnels: list[str] = []
    asked = Event()

    monkeypatch.setattr("viser._viser.ViserTunnel", lambda host, _: tunnels.append(host))
    monkeypatch.setattr("viser._viser.print_threadpool_errors", lambda _: asked.set())
    with connect(
        f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol(f"viser-v{viser.__version__}")]
    ) as browser:
        browser.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        assert asked.wait(60)
    assert tunnels == []


@pytest.mark.parametrize(
    ("host", "shown"),
    [
        ("::1", "[::1]"),
        ("example.org", "example.org"),
        ("", "box.lan"),
        ("0.0.0.0", "box.lan"),
        ("::", "box.lan"),
    ],
)
def test_a_page_is_where_browsers_find_it(
    monkeypatch: pytest.MonkeyPatch, host: str, shown: str
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "box.lan")
    found = urlsplit(address(host, 8080))
    assert (found.netloc, found.port) == (f"{shown}:8080", 8080)


def test_a_port_that_is_taken_is_said_with_the_tunnel_to_the_one_in_its_place() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        taken = other.getsockname()[1]
        page = Page(studio(), subject(), resolution=64, host="127.0.0.1", port=taken)
        with closing(page):
            found = page._server.get_port()
    assert page.where == (
        f"http://127.0.0.1:{found} (port {taken} is taken; over SSH: "
        f"ssh -L {found}:127.0.0.1:{found} MACHINE)"
    )


@pytest.mark.parametrize("asked", [0, None])
def test_of_a_port_that_is_free_only_the_address_is_said(asked: int | None) -> None:
    if asked is None:
        with socket.create_server(("127.0.0.1", 0)) as free:
            asked = free.getsockname()[1]
    page = Page(studio(), subject(), resolution=64, host="127.0.0.1", port=asked)
    with closing(page):
        assert page.where == f"http://127.0.0.1:{page._server.get_port()}"


@pytest.mark.parametrize(
    ("host", "port", "message"),
    [
        ("127.0.0.1", 80_000, "port: 80000: give 0 to 65535"),
        ("127.0.0.1", -1, "port: -1: give 0 to 65535"),
        ("192.0.2.1", 8080, "host: 192.0.2.1, port: 8080: cannot be opened"),  # RFC 5737
        ("no.such.name.invalid", 8080, "host: no.such.name.invalid: no address"),
    ],
)
def test_addresses_that_there_are_not_are_named(host: str, port: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        viser_server(host=host, port=port)


@pytest.mark.parametrize(
    ("origin", "name", "host", "own"),
    [
        ("http://localhost:9000", "localhost:9000", "127.0.0.1", True),  # through a tunnel
        ("http://evil.example:8080", "evil.example:8080", "127.0.0.1", False),  # resolves here
        ("http://box.lan:8080", "box.lan:8080", "0.0.0.0", True),
        ("http://evil.example", "box.lan:8080", "0.0.0.0", False),
        ("http://localhost:8080", None, "127.0.0.1", False),
    ],
)
def test_origins(origin: str, name: str | None, host: str, own: bool) -> None:
    assert is_own_page(origin, name, host=host) is own
