"""The proof: challenges with a concealed effect, by a simulator that shares nothing with the estimator."""
