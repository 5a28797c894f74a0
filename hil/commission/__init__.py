"""Commissioning: the job from the first look for devices to model file and report, step by step, and resumable.

What lives here: order, steps, predictions, findings. What may come in: a rig (`hil.rig`), the estimator, reports; only
`runner` drives.
"""
