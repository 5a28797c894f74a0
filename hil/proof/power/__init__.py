"""How small an effect is found, beside the best test there can be."""
