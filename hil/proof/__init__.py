"""The proof: challenges with a concealed effect, by a simulator that shares nothing with the estimator.

What lives here: ``truth`` (the simulator), seals, sets, campaigns, real recordings. What may come in: everything, but
for ``truth`` and ``mismatch``, which import nothing of ``estimator``.
"""
