"""What a hidden effect leaves of recordings once the bus is re-tuned, and at which frequencies.

The truth simulator alone says what is true: no noise, and nothing of ``estimator``.
"""
