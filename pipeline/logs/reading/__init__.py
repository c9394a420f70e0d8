"""From files to a log in SI units and joint order."""
