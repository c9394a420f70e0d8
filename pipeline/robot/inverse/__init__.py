"""Ways from a foot's place to its leg's joints: in closed form, by iteration, with least motion."""
