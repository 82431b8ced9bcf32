"""Entry point of `python -m ngi.gpu_check`."""

import sys

from ngi.studies.gpu_check.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
