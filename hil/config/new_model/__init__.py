"""A new model file: structure, values and tolerances, from a person, options or an identification."""
