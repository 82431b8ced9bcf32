"""Entry point of `python -m ngi.export`."""

import sys

from ngi.view.export import main

if __name__ == "__main__":
    sys.exit(main())
