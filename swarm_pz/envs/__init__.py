"""The environments: many games at once, and the faces that libraries know."""
