"""Marks for tests that train within pytest, which drops `ngi.learn.lightning_api`'s filters."""

import pytest

IGNORED = [
    pytest.mark.filterwarnings(r"ignore:`isinstance\(treespec, LeafSpec\)` is deprecated"),
]
"""The reasons stand there."""

RESUMED = pytest.mark.filterwarnings("ignore:.*your dataloader is not resumable")
"""For runs that go on."""
