"""What torque may depend on: bodies, friction, couplings, as columns."""
