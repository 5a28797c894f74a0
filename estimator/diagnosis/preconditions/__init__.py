"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""
