"""The compiled simulation: what moves, the laws at their places, one step, a whole recording.

What lives here is compiled by numba (`estimator.compiled`): a change costs each user a minute once. What may come in:
arrays and numbers; the laws come from the catalogue (`declared`).
"""
