"""How the questions of a new rig file are answered: by options, by a person, by the defaults."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hil.config.new_rig.questions import QUESTIONS, Answers, NotAnAnswer, Question, Value
from hil.errors import UsageError

Ask = Callable[[Question, str, str], str]
"""Asks a person: the question, its default (empty: none), what was wrong with the answer before (empty: nothing)."""


def answers(
    given: Mapping[str, str], simulated: bool, ask: Ask | None = None, known: Mapping[str, str] | None = None
) -> Answers:
    """Return an answer to every question."""
    found: dict[str, Value] = {}
    faults: list[str] = []
    for question in QUESTIONS:
        default = (known or {}).get(question.name, question.default(simulated))
        if question.name not in given and ask is not None:
            if not faults:
                found[question.name] = _asked(question, default, found, ask)
            continue
        text = given.get(question.name, default)
        if not text and question.name not in given:
            faults.append(f"{question.option} | expected {question.asks}: no default on a vehicle | got nothing")
            continue
        try:
            found[question.name] = question.read(text.strip(), found)
        except NotAnAnswer as fits:
            faults.append(f"{question.option} | expected {fits} | got {text!r}")
    if faults:
        raise UsageError("\n".join(faults))
    return found


def _asked(question: Question, default: str, found: Answers, ask: Ask) -> Value:
    wrong = ""
    while True:
        text = ask(question, default, wrong).strip() or default
        try:
            return question.read(text, found)
        except NotAnAnswer as fits:
            wrong = f"expected {fits}, got {text!r}" if text else f"expected {fits}: there is no default"
