"""Commissioning: the job from the first look for devices to model file and report, step by step, and resumable.

What lives here: steps, findings. What may come in: a rig (`hil.rig`), ordered runs (`hil.orders`), the loop of
`hil solve` (`hil.design`), the estimator, reports.
"""
