"""A state file with every field filled, as a commissioning that went through all steps leaves it."""

from pathlib import Path
from typing import Any

from hil.commission.engine import STEPS
from hil.commission.state import Finding, Note, RunRecord, State, Status, StepRecord, stated

TIME_S = [0.0, 0.5, 1.0]
SERIES = [0.1, None, -0.2]
LINEAR = {"sample_time_s": 0.01, "poles": [[0.9, 0.1], [0.9, -0.1]], "zeros": [[0.5, 0.0]], "resonance": [8.2, 0.05]}
MODEL = {
    "structure": "two_mass",
    "parameters": {
        name: [value, 0.2]
        for name, value in {"J_M": 1.6, "J_L": 95.0, "k": 4200.0, "c": 9.0, "b_M": 0.3, "b_L": 0.9}.items()
    },
}


def course(*names: str) -> dict[str, Any]:
    return {"time_s": TIME_S, **dict.fromkeys(names, SERIES)}


EVIDENCE: dict[str, dict[str, Any]] = {
    "noise": {"speed_std_rad_s": 0.05, "course": course("speed_rad_s")},
    "signs": {name: {"course": course("reference_nm", "reading_nm", "speed_rad_s")} for name in ("m1", "m2")},
    "scales": {
        "gain": [1.02, 0.01], "delay_s": [0.0, 0.001], "extra_samples": 1, "amplitude_nm": 20.0, "duration_s": 12.0,
        "resonance": [8.2, 0.05], "spread": [0.1, 0.01], "model": MODEL,
    },
    "friction": {"inertia_kg_m2": [97.0, None], "course": course("torque_nm", "speed_rad_s")},
    "prbs": {"amplitude_nm": 30.0, "reason": "as small as the resonance needs", "tries": []},
    "identification": {
        "runs": [
            {
                "run": "cruise", "best": LINEAR, "online": LINEAR, "frequency_hz": [1.0, 2.0], "magnitude": [0.1, 0.2],
                "spectral": {"frequency_hz": [1.0, 2.0], "magnitude": [0.1, None], "coherence": [0.9, 0.8]},
            }
        ]
    },
    "validation": {
        "model": MODEL,
        "worst": {"name": "cruise", **course("simulated_rad_s", "measured_rad_s")},
    },
    "diagnosis": {
        "verdict": "explained", "statement": "The shaft has a backlash.", "report": "diagnosis/report.html",
        "model_file": "model.toml",
    },
}  # fmt: skip


def whole_state(folder: Path) -> State:
    state = State(folder, "bus", "rig.toml", 'name = "bus"', {step.name: StepRecord() for step in STEPS})
    state.notes = [Note(state.started_utc, "kept", "period_s", "noise")]
    ranges = {name: [-1.0, 1.0] for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s", "speed_measured_rad_s")}
    for name, step in state.steps.items():
        for attempt in (Status.INTERRUPTED, Status.DONE):
            step.begin("digest", keep_runs=False)
            step.findings = [Finding("gain", "1 ± 2 %", "3.1 %", False, "Calibrate"), stated("torque", "20 Nm")]
            step.evidence = EVIDENCE.get(name, {})
            step.runs = [RunRecord(f"{name}-1", f"runs/{name}.csv", True, 3.5, ranges, ranges, 1, 300, 20.0, 0.1)]
            step.end(attempt, "for a reason")
    return state
