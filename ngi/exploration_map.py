"""Entry point of `python -m ngi.exploration_map`."""

import sys

from ngi.studies.exploration_map.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
