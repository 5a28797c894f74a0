"""What the data say by frequency, without a model."""
