"""Laws of the simulated machine, each with a state that is stepped in time."""
