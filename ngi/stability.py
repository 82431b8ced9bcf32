"""Entry point of `python -m ngi.stability`."""

import sys

from ngi.studies.stability.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
