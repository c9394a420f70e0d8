"""What is held against the paper, and how sure it is."""
