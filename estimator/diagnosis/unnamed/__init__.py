"""Laws without a name: at each element the best sparse sum of functions, the rival that every name must beat."""
