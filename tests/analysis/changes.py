"""Changes of result files."""

from collections.abc import Callable
from typing import Any


def set_value(*path: str, value: object) -> Callable[[dict[str, Any]], None]:
    """A change of a result file, for `make_run`."""

    def change(result: dict[str, Any]) -> None:
        for key in path[:-1]:
            result = result[key]
        result[path[-1]] = value

    return change
