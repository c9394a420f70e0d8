"""What a machine does: walk, stand, what its sensors show, how it moves."""
