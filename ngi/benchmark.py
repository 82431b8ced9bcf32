"""Entry point of `python -m ngi.benchmark`."""

import sys

from ngi.studies.benchmark.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
