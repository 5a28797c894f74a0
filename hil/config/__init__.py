"""The files an engineer writes by hand, and everything that can be wrong in them."""
