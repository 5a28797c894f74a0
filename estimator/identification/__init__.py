"""Identification: linear models of what a recording shows, recursive and off line, and their modes.

What lives here: ``online`` (recursive), ``offline`` (batch), ``spectral``, ``modes``, ``tracking``. What may come in:
`estimator.signals` and arrays; no physics of a driveline but in ``modes`` and the two-mass filter.
"""
