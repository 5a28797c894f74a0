"""``python -m tests.benchmarks.memory RECORDINGS.npz [identify]``: one job in a process of its own, and what it took.

The job is a diagnosis, or an identification of each recording. Written as one line: peak resident memory once the
recordings are loaded and at the end [MiB], processor time of the job [s] without the programs' own beginning, and the
verdict.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

from estimator.diagnosis.diagnose import diagnose
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import FloatArray, Record
from hil.report.identification_files import identify_all
from tests.benchmarks.cases import Case

KIB_PER_MIB = 1024


def write_case(path: Path, case: Case) -> None:
    """Write a case for another process."""
    arrays: dict[str, FloatArray] = {}
    for i, record in enumerate(case.records):
        arrays |= {f"{i}_time_s": record.time_s, f"{i}_torque_nm": record.torque_nm, f"{i}_output": record.output}
    parameters = {name: (each.value, each.tolerance) for name, each in case.model.parameters.items()}
    np.savez(path, parameters=json.dumps(parameters), recordings=len(case.records), **arrays)


def read_case(path: Path) -> Case:
    """Read a case that another process wrote."""
    with np.load(path) as stored:
        parameters = {name: Parameter(*values) for name, values in json.loads(str(stored["parameters"])).items()}
        records = tuple(
            _record(i, stored[f"{i}_time_s"], stored[f"{i}_torque_nm"], stored[f"{i}_output"])
            for i in range(int(stored["recordings"]))
        )
    return Case(DrivelineModel(Structure.TWO_MASS, parameters), records)


def _record(index: int, time_s: FloatArray, torque_nm: FloatArray, output: FloatArray) -> Record:
    period_s = float(time_s[1] - time_s[0])
    okay = np.ones(time_s.size, dtype=np.bool_)
    return Record(f"run_{index + 1}", period_s, time_s, torque_nm, output, okay)


def peak_mib() -> float:
    """Return the peak resident memory of this program [MiB], by Linux.

    ``getrusage`` won't do: its peak begins with that of the process that started this one.
    """
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return float(status["VmHWM"].removesuffix("kB")) / KIB_PER_MIB


def main(arguments: list[str]) -> int:
    """Do the job of a case and write what it took."""
    case = read_case(Path(arguments[0]))
    loaded, begun_s = peak_mib(), time.process_time()
    if arguments[1:] == ["identify"]:
        verdict = ", ".join(sorted({each.best.verdict.value for each in identify_all(case.records, Settings())}))
    else:
        verdict = diagnose(case.records, case.model).verdict.value
    taken_s = time.process_time() - begun_s
    found = {"loaded_mib": loaded, "peak_mib": peak_mib(), "processor_s": taken_s, "verdict": verdict}
    sys.stdout.write(json.dumps(found) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
