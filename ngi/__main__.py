"""Entry point of `python -m ngi`."""

import sys

from ngi.cli import main

if __name__ == "__main__":
    sys.exit(main())
