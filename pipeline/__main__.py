"""Entry point of ``python -m pipeline``."""

import sys

from pipeline.app.cli import main

if __name__ == "__main__":
    sys.exit(main())
