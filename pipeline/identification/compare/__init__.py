"""Where measured and predicted effort differ, and by how much."""
