"""Diagnosis by likelihood: sets of effects, each with disturbances of its own, compared by one number."""
