"""What a diagnosis did to recordings, written down and done again, so that its figures can be repeated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from estimator.diagnosis.preconditions.channels import with_motion_corrected
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.segments import thin
from estimator.physics.catalogue import EFFECTS
from estimator.signals.record import Record
from hil.config.model_tables import Prepared, PreparedRecording
from hil.plants.plant import Events
from hil.provenance import Source
from hil.recording.signals import Tell


def prepared_by(diagnosis: Diagnosis, records: Sequence[Record], paths: Sequence[Path | None]) -> Prepared:
    """Return what a diagnosis did to its recordings before it fitted."""
    traces = {trace.name: trace for trace in diagnosis.traces}
    used = [
        PreparedRecording(
            events=_events(diagnosis, r),
            name=r.name,
            sha256=Source.of(path).sha256 if path else "",
            samples_used=int(traces[r.name].okay.sum()),
        )
        for r, path in zip(records, paths, strict=True)
        if r.name in traces
    ]
    return Prepared(one_in=_one_in(diagnosis, records), recordings=used)


def _events(diagnosis: Diagnosis, record: Record) -> dict[str, list[float]]:
    """Return from when to when each event acts in a recording, since it began [s]; of those that act once."""
    began = float(record.time_s[0] - record.since_start_s[0])
    found = {
        effect.name: effect.time_s.get(record.name, ())
        for effect in diagnosis.effects
        if effect.name in EFFECTS and EFFECTS[effect.name].event
    }
    return {name: [float(end) - began for end in spans[0]] for name, spans in found.items() if len(spans) == 1}


def known_events(prepared: Prepared | None, paths: Sequence[Path | None]) -> Events:
    """Return the moments of events that a diagnosis found, of those recordings that it was given."""
    sums = {path.stem: Source.of(path).sha256 for path in paths if path is not None}
    return {
        each.name: {
            (effect, name): moment
            for effect, moments in each.events.items()
            for name, moment in zip(("from_s", "to_s"), moments, strict=True)
        }
        for each in (prepared.recordings if prepared is not None else ())
        if each.events and each.sha256 and sums.get(each.name) == each.sha256
    }


def _one_in(diagnosis: Diagnosis, records: Sequence[Record]) -> int:
    """Return to one in how many samples the first recording was thinned; 1 where nothing was decided."""
    if not diagnosis.traces:
        return 1
    record = next(r for r in records if any(trace.name == r.name for trace in diagnosis.traces))
    trace = next(trace for trace in diagnosis.traces if trace.name == record.name)
    return max(1, round(float(trace.time_s[1] - trace.time_s[0]) / record.sample_time_s))


def prepare_again(
    records: Sequence[Record], prepared: Prepared | None, tell: Tell, keep_rows: bool = False
) -> tuple[Record, ...]:
    """Return recordings as a diagnosis took them; as they are where the model is of none."""
    if prepared is None:
        return tuple(records)
    if prepared.mended:
        mended, said = with_motion_corrected(records)
        for line in said:
            tell(line)
        records = mended
    if keep_rows or prepared.one_in == 1:
        return tuple(records)
    tell(f"thinned to one in {prepared.one_in} samples, as hil diagnose did")
    return tuple(thin(record, prepared.one_in) for record in records)
