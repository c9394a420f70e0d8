"""What the paper leaves out, put in: how far its answer moves."""
