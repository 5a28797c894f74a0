"""What is asked of recordings and model before anything is fitted: refused, corrected with a warning, or passed on."""
