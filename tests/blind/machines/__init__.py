"""Machines with something hidden in them; no law is shared with the workflow that is to find it."""
