"""The driveline: one superset model that holds every effect, of which the nominal model is a special case.

What lives here: catalogue and effects, the compiled kernel, the free run and its fit. What may come in: records,
models, `estimator.signals`; nothing that judges a fit.
"""
