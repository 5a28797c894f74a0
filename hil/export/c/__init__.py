"""The laws of the driveline in C: translated from the Python that the kernel is compiled from.

A law is written once, in the part of Python that numba compiles; what is added to the catalogue is in the C, too.
"""
