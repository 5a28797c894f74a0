"""How large an effect put into the simulated rig may be: the catalogue's own bounds, at the limits of the rig.

The catalogue gives the bounds of a fit in multiples of a scale taken from recordings. Before there is any, the
widest recording the rig could make stands for them: full torque and full speed either way, at its SYNC period.
An effect beyond that could not be found again, and is most often a slip of the unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import EffectParameter
from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, Record
from hil.config.rig_file import Rig
from hil.simulator.plc_device import PlcSetup

NO_EXPERIMENT_S = 60.0
"""Length of the widest recording where the rig file has no experiment [s]."""


def out_of_bounds(rig: Rig, model: DrivelineModel, name: str, values: Mapping[str, float]) -> Iterator[str]:
    """Name every parameter of an effect that is outside its bounds.

    Parameters
    ----------
    rig
        Whose limits count.
    model
        The driveline, the effect included.
    name
        The effect, one of the catalogue.
    values
        Its parameters as they were given [SI].
    """
    effect = EFFECTS[name]
    scales = effect.scales(model, [_widest_record(rig)])
    for parameter, scale in zip(effect.shared_parameters, scales, strict=True):
        low, high = scale * parameter.low, scale * parameter.high
        value = values.get(parameter.name)
        if value is not None and not low <= value <= high and not _is_left_out(parameter, value):
            unit = parameter.unit(model.motion).removeprefix("1")  # what has no unit has "1"
            yield (
                f"effect {name!r}: {parameter.name} is {value:g}, expected {f'{low:.3g} to {high:.3g} {unit}'.strip()}"
                ", the catalogue's bounds at this rig's period and limits of torque and speed"
            )


def _is_left_out(parameter: EffectParameter, value: float) -> bool:
    """Tell whether a parameter is as good as not given: optional and at its null, wherever its bounds begin."""
    return parameter.optional and value == parameter.null


def _widest_record(rig: Rig) -> Record:
    """Make a recording at the rig's limits, one way and then the other."""
    duration_s = max((table.duration_s for table in rig.experiments.values()), default=NO_EXPERIMENT_S)
    samples = max(2, round(duration_s / rig.period_s))
    time_s: FloatArray = np.arange(samples, dtype=np.float64) * rig.period_s
    direction = np.where(np.arange(samples) < samples // 2, 1.0, -1.0)
    return Record(
        name="limits of the rig",
        sample_time_s=rig.period_s,
        time_s=time_s,
        torque_nm=rig.guard.sum_limit_nm * direction[:, np.newaxis],
        output=PlcSetup().speed_limit_rad_s * direction,
        okay=np.ones(samples, dtype=bool),
    )
