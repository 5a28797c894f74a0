"""Buses of the benchmarks' own: a two-mass line on a rough road with a driver in the loop, its truth exactly known.

Written apart from every model of the product: nothing of ``estimator.physics``, ``estimator.diagnosis``,
``hil.simulator`` or ``hil.proof`` is imported here, and the line is written as masses, dampers and springs.
"""
