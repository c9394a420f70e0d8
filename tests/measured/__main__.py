"""`python -m tests.measured`: write the table of measured over predicted power anew."""

from tests.measured.measured import main

main()
