"""Which of the forces that the ground could give is taken, by what it costs."""
