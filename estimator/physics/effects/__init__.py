"""The effects, one file each: its law, its parameters, where a fit starts, and what is known of it.

A new effect is one file here and two lines in `estimator.physics.catalogue` (docs/extend.md). What may come in: the
motion of the line and its parameters as floats or SIMD lanes; an effect knows no other one.
"""
