"""The next experiment: what recordings leave open, what they did not test, and experiments judged on paper."""
