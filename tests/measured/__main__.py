"""`python -m tests.measured`: write the table of predicted over measured power anew."""

from tests.measured.measured import main

main()
