"""Entry point of `python -m ngi.render`."""

import sys

from ngi.view.picture import main

if __name__ == "__main__":
    sys.exit(main())
