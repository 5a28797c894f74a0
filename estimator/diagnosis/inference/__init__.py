"""Diagnosis by likelihood: hypotheses are sets of effects, each with disturbances of its own, compared by one number.

``disturbances``: the noise of a free-run error and the Kalman filter that whitens it. ``likelihood``: the fit of a
hypothesis under that weighting, and its score. ``looks``: which effects are worth a fit. ``search``: add, drop,
exchange. ``judge``: probability and weight of an effect, and the decision.
"""
