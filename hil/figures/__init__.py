"""The paper's figures from eight on-road-like experiments, or from any recordings; with the truth where it is known.

What may come in: a simulated rig, recordings, the estimator; no command line.
"""
