"""Entry point of ``python -m pipeline``."""

import os
import sys

# Before NumPy is loaded: the matrices are small, and threads of its linear algebra would wait for
# one another (on two busy cores the demonstration of `gap` took 2.6 times the CPU with them).
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

from pipeline.commands.main import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
