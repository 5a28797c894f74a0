"""Many sealed cases, scored."""
