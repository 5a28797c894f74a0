"""``hil run --dry-run``: what a run would do, with no bus opened and nothing written."""

from __future__ import annotations

import json
from dataclasses import asdict

from hil.cli.printing import say
from hil.config.rig_file import Rig
from hil.rig.dry_run import dry_run


def predict(rig: Rig, experiment: str, as_json: bool, trust_laws: bool) -> None:
    """Print torque and speed of an experiment as predicted."""
    prediction = dry_run(rig, experiment, trust_laws)
    if as_json:
        say(json.dumps({"schema": "hil.dry_run/1", "experiment": experiment, **asdict(prediction)}))
        return
    rows = (
        ("base torque of both inverters", prediction.torque_nm, "Nm"),
        ("torque of m1, PRBS included", prediction.torque_m1_nm, "Nm"),
        ("torque of m2, PRBS included", prediction.torque_m2_nm, "Nm"),
        ("speed", prediction.speed_rad_s, "rad/s"),
        ("speed in the recorded part", prediction.speed_measured_rad_s, "rad/s"),
    )
    say(
        f"{experiment}: {prediction.cycles * prediction.period_s:.1f} s, "
        f"{prediction.measured * prediction.period_s:.1f} s of it recorded"
    )
    for what, values, unit in rows:
        say(f"  {what:32}{values.low:10.2f} to {values.high:8.2f} {unit}")
    say(f"  predicted with {prediction.vehicle.source}; the torque guard lets every cycle through")
