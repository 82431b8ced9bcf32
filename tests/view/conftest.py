"""What tests of the page share."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def browser() -> Iterator[Any]:
    """A stand-in, `tests.view.browser.Browser`, where the extra 'viewer' is installed."""
    pytest.importorskip("viser", reason="needs pip install -e .[viewer]")
    from ngi.view.page import viser_server
    from tests.view.browser import Browser

    server = viser_server(host="127.0.0.1", port=0)
    yield Browser(server.gui)
    server.stop()
