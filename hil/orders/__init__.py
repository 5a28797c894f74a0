"""Runs as they are ordered: predicted, agreed to by the operator, driven within a band of speed, recorded.

What lives here: order, prediction, the operator's answers; only `runner` drives. What may come in: a rig (`hil.rig`).
"""
