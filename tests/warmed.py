"""What every command does first, whatever its words are, done once before commands are forked."""

import functools

import pandas  # noqa: F401
from hydra.core.plugins import Plugins
from lightning.pytorch.trainer.connectors import callback_connector
from PIL import Image

from ngi.config.configuration import composed
from ngi.files.code_versions import code_version
from tests import quick_hydra

quick_hydra.use()
Plugins.instance()
Image.init()
code_version()
composed("renderer=analytic", "budget=smoke")
# it looks through the entry points of all that is installed
callback_connector._load_external_callbacks = functools.cache(  # type: ignore[assignment]
    callback_connector._load_external_callbacks
)
