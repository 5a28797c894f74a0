"""The next experiment: designed to decide between what recordings leave open, and driven until it is decided."""
