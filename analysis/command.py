"""How commands of this package end."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import ParamSpec

P = ParamSpec("P")


def errors_in_a_line(main: Callable[P, int]) -> Callable[P, int]:
    """The entry point, which ends with status 1 and a line where it raises OSError or ValueError.

    After Ctrl-C with 130, and nothing said, as all of the program does.
    BrokenPipeError is passed on: that nobody reads the output is not an error of what was given.
    """

    @functools.wraps(main)
    def command(*args: P.args, **kwargs: P.kwargs) -> int:
        try:
            return main(*args, **kwargs)
        except BrokenPipeError:
            raise
        except (OSError, ValueError) as error:
            print(f"error: {error}", file=sys.stderr)
            return 1
        except KeyboardInterrupt:
            return 130

    return command
