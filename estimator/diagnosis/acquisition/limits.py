"""What makes a finding: beyond chance, and large enough to matter."""

LEVEL = 1e-6
"""Largest probability by chance. A handful of tests on every recording ever diagnosed shall not raise a false alarm."""

SMALLEST_SHARE = 0.002
"""Smallest share of touched rows worth a finding. One row in five hundred costs a fit next to nothing: masked or not,
its variance grows by the like. At one in two hundred and thirty the search for laws without a name still sees them (a
sealed case, seed 701), and what it sees should have its name."""

SMALLEST_P = 1e-300
"""Stands for any smaller probability, so that logarithms stay finite."""
