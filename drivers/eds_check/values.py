"""Rules for numbers: defaults that can be read and fit, limits, octal numbers, formulas with the node id."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.datasheet.dictionary import read_octets, read_real
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.datasheet.number import octal_matters, read_formula, read_number
from drivers.datasheet.objects import EdsEntry
from drivers.datasheet.types import OCTET_STRING, DataType
from drivers.eds_check.context import EdsContext, at_key

_LIMITS = ("LowLimit", "HighLimit")
_TEXT_KEYS = ("parametername", "denotation", "defaultvalue", "parametervalue", "accesstype")


def check_values(context: EdsContext) -> Iterator[EdsFinding]:
    """Check the numbers of every value of the object dictionary."""
    for described in context.objects.values():
        seen = set()
        for entry in described.entries.values():
            if entry.section.line not in seen:  # those of CompactSubObj share one section
                seen.add(entry.section.line)
                yield from _numbers(context, entry)
                if entry.kind is not None:
                    yield from _value(context, entry, entry.kind)


def _numbers(context: EdsContext, entry: EdsEntry) -> Iterator[EdsFinding]:
    """Find numbers whose leading 0 changes them, or makes them none."""
    is_integer = entry.kind is not None and entry.kind.is_integer
    for name, key in entry.section.keys.items():
        if (name not in _TEXT_KEYS or (name == "defaultvalue" and is_integer)) and octal_matters(key.value):
            value = read_number(key.value)
            found = "no octal number" if value is None else f"octal, {value}:"
            expected = "a number without a leading 0, which makes it octal (CiA 306)"
            severity = context.severity(entry.index) if value is None else Severity.WARNING
            yield at_key(severity, entry.section, key.name, expected, found, "Write it in decimal or as 0x.")


def _value(context: EdsContext, entry: EdsEntry, kind: DataType) -> Iterator[EdsFinding]:
    if not kind.is_integer:
        yield from _other_value(context, entry, kind)
        return
    severity = context.severity(entry.index)
    expected = f"a number of {kind.name}, {kind.low} to {kind.high}"
    if entry.value_text is not None:
        if entry.value(context.node_id) is None and not octal_matters(entry.value_text):
            yield at_key(
                severity, entry.section, entry.value_key, expected, "", "Write one that fits, or leave it blank."
            )
        yield from _formula(entry)
    for key in _LIMITS:
        if entry.section.get(key) is not None and entry.limit(key, context.node_id) is None:
            yield at_key(Severity.WARNING, entry.section, key, expected, "", "It is left out; correct it.")
    yield from _within_limits(context, entry)


def _other_value(context: EdsContext, entry: EdsEntry, kind: DataType) -> Iterator[EdsFinding]:
    text = entry.value_text
    if text is None:
        return
    if kind.is_real and read_real(text) is None:
        yield at_key(Severity.WARNING, entry.section, entry.value_key, f"a number ({kind.name})", "", "Correct it.")
    elif kind.code == OCTET_STRING and read_octets(text) is None:
        expected = "pairs of hexadecimal digits (OCTET_STRING)"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "It is left out; correct it.")


def _formula(entry: EdsEntry) -> Iterator[EdsFinding]:
    formula = read_formula(entry.value_text or "")
    if formula is not None and formula.of_node_id and not formula.node_id_first:
        expected = f"$NODEID+0x{formula.constant:X}, the node id in front (CiA 306)"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "Read so; turn it round.")


def _within_limits(context: EdsContext, entry: EdsEntry) -> Iterator[EdsFinding]:
    low, high = (entry.limit(key, context.node_id) for key in _LIMITS)
    if low is not None and high is not None and low > high:
        expected = f"at least LowLimit ({low})"
        yield at_key(Severity.WARNING, entry.section, "HighLimit", expected, "", "Correct one of the two.")
        return
    default = entry.value(context.node_id)
    formula = read_formula(entry.value_text or "")
    if default is None or formula is None or formula.of_node_id:
        return
    below, above = low is not None and default < low, high is not None and default > high
    if below or above:
        expected = f"at least LowLimit ({low})" if below else f"at most HighLimit ({high})"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "Correct one of the two.")
