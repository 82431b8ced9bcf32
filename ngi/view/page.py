"""The web server whose page shows a network, to any number of browsers."""

from __future__ import annotations

import logging
import time
import warnings

import viser

from ngi.view.server import fenced, viser_server
from ngi.view.studio import Studio
from ngi.view.subject import Subject
from ngi.view.visitor import Visitor


class Page:
    """Serves a page about `subject`, with the pictures that `studio` makes.

    resolution: pixels a side at first
    host: '127.0.0.1' for browsers of this machine only
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
        self._server = viser_server(host=host, port=port, label=subject.name)
        self._server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self._server.gui.main_panel.dock_right()
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(lambda client: studio.close(client.client_id))
        self.address = f"http://{host}:{self._server.get_port()}"

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
        self._studio.open(client.client_id, visitor.wish, visitor.show)


class ErrorPage:
    """Says why there is nothing to see."""

    def __init__(self, message: str, *, host: str, port: int) -> None:
        self._server = viser_server(host=host, port=port)
        self._server.gui.add_markdown(f"**This run cannot be shown.**\n\n{fenced(message)}")
        self.address = f"http://{host}:{self._server.get_port()}"

    def wait(self) -> None:
        """Until the program is ended."""
        while True:
            time.sleep(1)

    def close(self) -> None:
        self._server.stop()
