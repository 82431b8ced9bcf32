"""Writes the tutorial on data frames as a notebook: `python tools/notebook.py`.

The page is where it is edited; a test compares the two and runs the notebook's cells.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "tutorials" / "results.md"
NOTEBOOK = PAGE.with_suffix(".ipynb")
LINK = "[This page as a notebook](results.ipynb)\n\n"


def notebook(page: str) -> dict[str, Any]:
    """In nbformat 4.5: a cell of code for each block of Python, of Markdown for what is between."""
    cells = []
    parts = re.split(r"^```python\n(.*?)^```\n", page.replace(LINK, ""), flags=re.M | re.S)
    for number, part in enumerate(parts):
        code = number % 2 == 1
        cell = {"cell_type": "code" if code else "markdown", "id": f"cell-{number}"}
        extra = {"execution_count": None, "outputs": []} if code else {}
        cells.append({**cell, "metadata": {}, "source": part.strip(), **extra})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": [cell for cell in cells if cell["source"]],
        "metadata": {"kernelspec": kernel},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def text(page: str) -> str:
    """The notebook's file."""
    return json.dumps(notebook(page), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    NOTEBOOK.write_text(text(PAGE.read_text()))
