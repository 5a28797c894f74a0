"""What can be held against a recording: a model file, or another program's model as an FMU."""

from hil.plants.plant import ModelPlant, Plant

__all__ = ["ModelPlant", "Plant"]
