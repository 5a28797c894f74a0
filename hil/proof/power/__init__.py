"""How small an effect is found, next to the best test there can be."""
