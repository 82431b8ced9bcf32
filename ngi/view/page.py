"""The web server whose page shows a network, to any number of browsers and to no other page."""

import errno
import logging
import socket
import warnings
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from threading import Lock
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import viser
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from ngi.view.session import Wish
from ngi.view.studio import Studio
from ngi.view.subject import Subject
from ngi.view.visitor import Visitor

LAST_PORT = 2**16 - 1

LOOPBACK = ("127.0.0.1", "localhost", "::1")

EVERYWHERE = ("", "0.0.0.0", "::")

Answer = Response | None
Processor = Callable[[ServerConnection, Request], Answer | Awaitable[Answer]]

_changing = Lock()


def viser_server(*, host: str, port: int, label: str | None = None) -> viser.ViserServer:
    """A server that refuses websockets opened by pages of other origins, with status 403.

    Any page that a browser shows may open a websocket to this machine, and says truly where it is
    from: that has to be this server, as the browser was told its name (through a tunnel the port
    may differ). Bound to a loopback address, the name must be one too, so that no foreign name that
    resolves to it does. Programs that are no browsers give no origin and are let in. It is shared
    with no public host, whoever asks.

    Raises ValueError as `check_address` does.
    """
    check_address(host, port)
    with _checking_origins(host):
        server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    # any browser may ask by a message for a tunnel to a public host, without a button for it too
    server.request_share_url = lambda *_, **__: None  # type: ignore[method-assign]
    return server


def address(host: str, port: int) -> str:
    """Of the page, for a browser; of other machines, too, where it is bound to `EVERYWHERE`."""
    name = socket.gethostname() if host in EVERYWHERE else host
    return f"http://{f'[{name}]' if ':' in name else name}:{port}"


def check_address(host: str, port: int) -> None:
    """Raises ValueError where no server can be opened; Viser would wait for ever.

    A port that is taken is no reason: Viser takes one of the next.
    """
    if not 0 <= port <= LAST_PORT:
        raise ValueError(f"port: {port}: give 0 to {LAST_PORT}")
    try:
        flags = socket.AI_PASSIVE
        found = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=flags)
    except OSError as error:
        raise ValueError(f"host: {host}: no address of this machine: {error}") from error
    for family, kind, protocol, _, address in found:
        try:
            probe = socket.socket(family, kind, protocol)
        except OSError:  # of a kind that this machine lacks, as IPv6: asyncio leaves it out, too
            continue
        try:
            _bind(probe, address)
        except OSError as error:
            if error.errno != errno.EADDRINUSE or port == LAST_PORT:
                said = f"host: {host}, port: {port}: cannot be opened: {error.strerror}"
                raise ValueError(said) from error


def _bind(probe: socket.socket, address: Any) -> None:
    """As asyncio does, and closes it."""
    with probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if probe.family == socket.AF_INET6:
            probe.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        probe.bind(address)


def is_own_page(origin: str | None, name: str | None, *, host: str) -> bool:
    """Whether a request's Origin is the server that its Host names; host: what it is bound to."""
    if origin is None:
        return True
    if name is None or urlsplit(origin).netloc != name:
        return False
    return host not in LOOPBACK or urlsplit(f"//{name}").hostname in LOOPBACK


@contextmanager
def _checking_origins(host: str) -> Iterator[None]:
    """Viser 1.1 has no place for such a check: the function that it serves by gets it meanwhile."""
    serve = websockets_server.serve

    def checked(*arguments: Any, process_request: Processor, **options: Any) -> Any:
        def process(connection: ServerConnection, request: Request) -> Answer | Awaitable[Answer]:
            headers = request.headers
            if is_own_page(headers.get("Origin"), headers.get("Host"), host=host):
                return process_request(connection, request)
            return connection.respond(HTTPStatus.FORBIDDEN, "opened by a page of another origin\n")

        return serve(*arguments, process_request=process, **options)

    with _changing:
        websockets_server.serve = checked  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            websockets_server.serve = serve  # type: ignore[misc]


class Page:
    """Serves a page about `subject`, with the pictures that `studio` makes.

        resolution: pixels a side at first
        host: '127.0.0.1' for browsers of this machine only

    A browser that comes begins with what the last one that left was looking at, so that one whose
    connection was lost goes on; its button "reset" leads to where the page begins.

        `where` is its address, with the tunnel for it where the port was taken.
    """

    def __init__(
        self, studio: Studio, subject: Subject, *, resolution: int, host: str, port: int
    ) -> None:
        # browsers hang up when they like
        logging.getLogger("websockets").setLevel(logging.CRITICAL)
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        self._studio = studio
        self._subject = subject
        self._resolution = resolution
        self._visitors: dict[int, Visitor] = {}
        self._left: Wish | None = None
        self._server = viser_server(host=host, port=port, label=subject.name)
        self._server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self._server.gui.main_panel.dock_right()
        if subject.camera is not None:  # where "Reset View" leads
            first = self._server.initial_camera
            first.position, first.look_at = subject.camera.view(subject.start)
            first.up = np.asarray(subject.camera.up)
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._leave)
        found = self._server.get_port()
        self.where = address(host, found)
        if port not in (0, found):
            tunnel = f"ssh -L {found}:{urlsplit(self.where).netloc} MACHINE"
            self.where += f" (port {port} is taken; over SSH: {tunnel})"

    @property
    def gui(self) -> viser.GuiApi:
        """What is added here all browsers share."""
        return self._server.gui

    @property
    def visitors(self) -> int:
        """Browsers that look at the page."""
        return len(self._server.get_clients())

    def close(self) -> None:
        self._server.stop()

    def _welcome(self, client: viser.ClientHandle) -> None:
        visitor = Visitor(client, self._subject, self._studio, resolution=self._resolution)
        if self._left is not None:
            visitor.restore(self._left)
        self._visitors[client.client_id] = visitor
        self._studio.open(client.client_id, visitor.wish, visitor.show, visitor.failed)
        if client.client_id not in self._server.get_clients():  # it left while that was built
            self._leave(client)

    def _leave(self, client: viser.ClientHandle) -> None:
        """What it looked at is kept for the next: Viser tells no one apart who comes back."""
        self._studio.close(client.client_id)
        if (visitor := self._visitors.pop(client.client_id, None)) is not None:
            self._left = visitor.wish
