"""What can be held against a recording: a model file, or another program's model as an FMU.

What lives here: simulation of a recording by a model, preparation as the diagnosis did it. What may come in: model
files and records; comparison and its pages are in `hil.report`.
"""

from hil.plants.plant import ModelPlant, Plant

__all__ = ["ModelPlant", "Plant"]
