"""All that knows the paper: its numbers, their calibration, and the judgement on them."""
