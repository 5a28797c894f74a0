"""What makes a finding: beyond chance, and large enough to matter."""

LEVEL = 1e-6
"""Largest probability by chance. A handful of tests on every recording ever diagnosed shall not raise a false alarm."""

SMALLEST_SHARE = 0.005
"""Smallest share of touched rows worth a finding. One row in two hundred costs a fit next to nothing: masked or not,
its variance grows by the like."""

SMALLEST_P = 1e-300
"""Stands for any smaller probability, so that logarithms stay finite."""
