"""Energy: supply and return, balance, motor limits."""
