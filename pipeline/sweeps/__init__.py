"""What a robot costs over many gaits, loads and dimensions: a row for every case."""
