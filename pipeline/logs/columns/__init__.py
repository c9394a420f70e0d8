"""Whether columns are what their names say, by what a motion asks of the machine."""
