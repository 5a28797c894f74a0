"""The model file of the bus that most recordings here are of."""

MODEL = """schema = "hil.model/1"
structure = "two_mass"
motion = "rotation"

[parameters]
J_M = { value = 1.6, tolerance = 0.2 }
J_L = { value = 100.0, tolerance = 0.2 }
k = { value = 4200, tolerance = 0.2 }
c = { value = 9.0, tolerance = 0.2 }
b_M = { value = 0.35, tolerance = 0.2 }
b_L = { value = 0.9, tolerance = 0.2 }
"""
