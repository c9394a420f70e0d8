"""The public Python API: one function per question, one result each."""
