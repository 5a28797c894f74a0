"""A small JSON-schema validator of its own (draft 2020-12, what the schemas here use); unknown keywords are refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

SAYS_NOTHING = {"$schema", "$defs", "title", "description", "default", "format", "discriminator"}

TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "number": (int, float),
    "integer": int,
}


class Validator:
    """Checks documents against one schema."""

    def __init__(self, schema: dict[str, Any]) -> None:
        self._schema = schema

    def faults(self, document: Any) -> list[str]:
        """Return where the document breaks the schema; nothing if it does not."""
        return list(self._faults(self._schema, document, ""))

    def _faults(self, schema: dict[str, Any] | bool, value: Any, place: str) -> Iterator[str]:
        if isinstance(schema, bool):
            if not schema:
                yield f"{place}: not allowed"
            return
        for keyword, rule in schema.items():
            if keyword not in SAYS_NOTHING:
                yield from getattr(self, "_" + keyword.strip("$"))(rule, value, place, schema)

    def _ref(self, rule: str, value: Any, place: str, _: Any) -> Iterator[str]:
        yield from self._faults(self._schema["$defs"][rule.removeprefix("#/$defs/")], value, place)

    def _type(self, rule: str, value: Any, place: str, _: Any) -> Iterator[str]:
        is_bool = isinstance(value, bool) and rule != "boolean"
        if is_bool or not isinstance(value, TYPES[rule]):
            yield f"{place}: no {rule}"

    def _enum(self, rule: list[Any], value: Any, place: str, _: Any) -> Iterator[str]:
        if value not in rule:
            yield f"{place}: none of {rule}"

    def _const(self, rule: Any, value: Any, place: str, _: Any) -> Iterator[str]:
        if value != rule:
            yield f"{place}: not {rule!r}"

    def _required(self, rule: list[str], value: Any, place: str, _: Any) -> Iterator[str]:
        yield from (f"{place}.{key}: missing" for key in rule if isinstance(value, dict) and key not in value)

    def _properties(self, rule: dict[str, Any], value: Any, place: str, _: Any) -> Iterator[str]:
        for key, inner in rule.items():
            if isinstance(value, dict) and key in value:
                yield from self._faults(inner, value[key], f"{place}.{key}")

    def _additionalProperties(self, rule: Any, value: Any, place: str, schema: dict[str, Any]) -> Iterator[str]:
        for key in value if isinstance(value, dict) else ():
            if key not in schema.get("properties", {}):
                yield from self._faults(rule, value[key], f"{place}.{key}")

    def _propertyNames(self, rule: Any, value: Any, place: str, _: Any) -> Iterator[str]:
        for key in value if isinstance(value, dict) else ():
            yield from self._faults(rule, key, f"{place}.{key}")

    def _items(self, rule: Any, value: Any, place: str, _: Any) -> Iterator[str]:
        for number, item in enumerate(value if isinstance(value, list) else ()):
            yield from self._faults(rule, item, f"{place}.{number}")

    def _anyOf(self, rule: list[Any], value: Any, place: str, _: Any) -> Iterator[str]:
        if all(list(self._faults(inner, value, place)) for inner in rule):
            yield f"{place}: fits none of {len(rule)}"

    def _oneOf(self, rule: list[Any], value: Any, place: str, _: Any) -> Iterator[str]:
        fitting = sum(not list(self._faults(inner, value, place)) for inner in rule)
        if fitting != 1:
            yield f"{place}: fits {fitting} of {len(rule)}"

    def _minimum(self, rule: float, value: Any, place: str, _: Any) -> Iterator[str]:
        yield from _bound(value, lambda number: number >= rule, f"{place}: below {rule}")

    def _maximum(self, rule: float, value: Any, place: str, _: Any) -> Iterator[str]:
        yield from _bound(value, lambda number: number <= rule, f"{place}: above {rule}")

    def _exclusiveMinimum(self, rule: float, value: Any, place: str, _: Any) -> Iterator[str]:
        yield from _bound(value, lambda number: number > rule, f"{place}: not above {rule}")

    def _exclusiveMaximum(self, rule: float, value: Any, place: str, _: Any) -> Iterator[str]:
        yield from _bound(value, lambda number: number < rule, f"{place}: not below {rule}")

    def _minLength(self, rule: int, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, str) and len(value) < rule:
            yield f"{place}: too short"

    def _maxLength(self, rule: int, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, str) and len(value) > rule:
            yield f"{place}: too long"

    def _pattern(self, rule: str, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, str) and re.search(rule, value) is None:
            yield f"{place}: does not match {rule}"

    def _minItems(self, rule: int, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, list) and len(value) < rule:
            yield f"{place}: too few"

    def _maxItems(self, rule: int, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, list) and len(value) > rule:
            yield f"{place}: too many"

    def _minProperties(self, rule: int, value: Any, place: str, _: Any) -> Iterator[str]:
        if isinstance(value, dict) and len(value) < rule:
            yield f"{place}: too few"


def _bound(value: Any, fits: Any, fault: str) -> Iterator[str]:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and not fits(value):
        yield fault
