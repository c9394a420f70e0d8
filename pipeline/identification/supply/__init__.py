"""What a machine takes from its supply, against the sum over its drives."""
