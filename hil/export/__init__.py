"""The on-line estimator for a PLC, and the driveline for other simulations.

What lives here: the estimator as Structured Text and PLCopen XML, the driveline as an FMU. What may come in: models,
effects, states of estimators; no rig.
"""
