"""What a side sees and how it answers: observations, named densities, and the forms libraries want them in."""
