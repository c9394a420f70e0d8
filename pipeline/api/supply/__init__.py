"""What a machine takes from its supply, as one call."""
