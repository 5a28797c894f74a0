"""A driveline model as it stands in the state file; as a file of its own it is `hil.config.model_file`'s."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimator.physics.model import DrivelineModel, Parameter, Structure


def model_json(model: DrivelineModel) -> dict[str, Any]:
    """Return structure and parameters; effects are left to model files."""
    return {
        "structure": model.structure.value,
        "parameters": {name: [each.value, each.tolerance] for name, each in model.parameters.items()},
    }


def model_from_json(document: Mapping[str, Any]) -> DrivelineModel:
    """Return the model again."""
    parameters = {name: Parameter(value, tolerance) for name, (value, tolerance) in document["parameters"].items()}
    return DrivelineModel(Structure(document["structure"]), parameters)
