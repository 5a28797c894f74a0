"""Signals: what was recorded, and the excitation that made it.

What lives here: `Record` (arrays and mask), PRBS, decimation, correlation. What may come in: arrays, and
`estimator.compiled`; nothing that knows a model.
"""
