"""A state file with every field filled, as a commissioning that went through all steps leaves it."""

from pathlib import Path
from typing import Any

from hil.commission.engine import STEPS
from hil.commission.state import CommissioningState, Note, Status, StepFinding, StepRecord, stated
from hil.orders.runner import RunRecord

COURSE = {"time_s": [0.0, 0.1, 0.2], "speed_rad_s": [0.0, None, 0.2]}
LINEAR = {
    "theta": [-1.5, 0.7, 0.01],
    "nk": 1,
    "sample_time_s": 0.02,
    "poles": [[0.7, 0.5], [0.7, -0.5]],
    "zeros": [[0.9, 0.0]],
    "resonance": [8.2, 0.05],
}
MODEL = {"structure": "one_mass", "parameters": {"J_M": [100.0, 0.2], "b_M": [0.5, 0.2]}}
PULSES = {
    "step_nm": 20.0,
    "speed": [0.1, 0.01],
    "reading": [1.0, None],
    "course": {**COURSE, "reference_nm": [0.0, 1.0, 0.0], "reading_nm": [0.0, 1.0, 0.0]},
}
EVIDENCE: dict[str, Any] = {
    "noise": {"speed_std_rad_s": 0.05, "speed_mean_rad_s": 0.0, "course": COURSE},
    "signs": {"m1": PULSES, "m2": PULSES},
    "scales": {
        "gain": [1.01, 0.02],
        "delay_s": [0.0, 0.001],
        "extra_samples": 1,
        "amplitude_nm": 20.0,
        "duration_s": 20.0,
        "resonance": [8.2, 0.05],
        "spread": [0.02, 0.1],
        "model": MODEL,
    },
    "friction": {
        "inertia_kg_m2": [100.0, 1.0],
        "dry_nm": [3.0, 0.1],
        "viscous_nm_s": [0.5, 0.1],
        "load_nm": [0.0, None],
        "rms_rad_s": 0.1,
        "course": {**COURSE, "torque_nm": [0.0, 1.0, 0.0]},
    },
    "prbs": {"amplitude_nm": 40.0, "reason": "as in the rig file", "tries": [{"amplitude_nm": 40.0}]},
    "identification": {
        "runs": [
            {
                "run": "cruise-1",
                "best": LINEAR,
                "batch": LINEAR,
                "online": LINEAR,
                "frequency_hz": [1.0, 2.0],
                "magnitude": [0.1, 0.2],
                "spectral": {"frequency_hz": [1.0], "magnitude": [0.1], "coherence": [0.9]},
            }
        ]
    },
    "validation": {
        "model": MODEL,
        "parameters": {"J_M": [100.0, 1.0]},
        "rms_rad_s": 0.1,
        "unseen": {"cruise-2": {"rms_rad_s": 0.1, "fit_percent": 90.0}},
        "worst": {"name": "cruise-2", "time_s": [0.0], "simulated_rad_s": [0.0], "measured_rad_s": [0.1]},
    },
    "diagnosis": {
        "verdict": "no_mismatch",
        "headline": "nothing missing",
        "statement": "Nothing is missing.",
        "effects": [],
        "report": "diagnosis/report.html",
        "model_file": "model.toml",
        "seconds": 4.2,
        "parameters": {"J_M": {"nominal": 100.0, "value": 101.0, "ci95": [100.0, 102.0], "unit": "kg m^2"}},
    },
    "solve": {
        "schema": "hil.solve/1",
        "rig_sha256": "0",
        "model_sha256": "0",
        "driven": [
            {
                "name": "coast from 60 rad/s",
                "table": {"kind": "coast"},
                "recording": "runs/solve.csv",
                "seconds": 3.5,
                "last_rad_s": 0.1,
                "promised_factor": 12.0,
                "promised_probability": 0.9,
            }
        ],
        "odds": [{"recordings": 2, "probabilities": {"backlash": 0.6, "nothing": 0.4}}],
        "end": "decided",
        "because": "",
        "verdict": "explained",
        "statement": "Missing is backlash.",
        "updated_utc": "2026-11-28T10:00:00+00:00",
    },
}


def whole_state(folder: Path) -> CommissioningState:
    state = CommissioningState(folder, "bus", "rig.toml", 'name = "bus"', {step.name: StepRecord() for step in STEPS})
    state.notes = [Note(state.started_utc, "kept", "period_s", "noise")]
    ranges = {name: [-1.0, 1.0] for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s", "speed_measured_rad_s")}
    for name, step in state.steps.items():
        for attempt in (Status.INTERRUPTED, Status.DONE):
            step.begin("digest", keep_runs=False)
            step.findings = [StepFinding("gain", "1 ± 2 %", "3.1 %", False, "Calibrate"), stated("torque", "20 Nm")]
            step.evidence = EVIDENCE.get(name, {})
            step.runs = [RunRecord(f"{name}-1", f"runs/{name}.csv", True, 3.5, ranges, ranges, 1, 300, 20.0, 0.1)]
            step.end(attempt, "for a reason")
    return state
