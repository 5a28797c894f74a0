"""Faults of TOML files in lines a person can act on."""

from pathlib import Path
from typing import Annotated, Literal, Self

import pytest
from pydantic import Field, model_validator

from hil.config.table import FileTable
from hil.errors import FileProblem, ModelFileError, RigFileError
from hil.problems import Fault, read_toml, refuse, validate


class Column(FileTable):
    column: str
    scale: float = 1.0


class Rate(FileTable):
    sample_time_s: float


class Cat(FileTable):
    kind: Literal["cat"]
    lives: int


class Dog(FileTable):
    kind: Literal["dog"]
    legs: int


class Limits(FileTable):
    low: float
    high: float

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        refuse(
            [Fault("low", "less than high", self.low), Fault("high", "more than low", self.high)]
            * (self.low > self.high)
        )
        return self


class Whole(FileTable):
    schema_id: Annotated[str, Field(alias="schema")] = "x"
    time: Column | Rate | None = None
    inputs: list[Column] = Field(default_factory=list)
    pets: dict[str, Annotated[Cat | Dog, Field(discriminator="kind")]] = Field(default_factory=dict)
    limits: Limits | None = None


def lines(data: dict[str, object]) -> list[str]:
    with pytest.raises(ModelFileError) as refusal:
        validate(Whole, data, Path("some.toml"), ModelFileError)
    assert refusal.value.path == Path("some.toml")
    return list(refusal.value.problems)


@pytest.mark.parametrize("error", [RigFileError, ModelFileError])
@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b'a = 1\nb = \nc = "x"\n', "line 2, column 5 | expected TOML | got: Invalid value"),
        (b"a = 1\na = 2\n", "line 2, column 6 | expected TOML | got: Cannot overwrite a value"),
        (b"[a]\n[a]\n", "line 2, column 3 | expected TOML | got: Cannot declare ('a',) twice"),
        (b'a = "open', "end of document | expected TOML | got: Unterminated string"),
        (b"a = 1\n# caf\xe9\n", "line 2 | expected UTF-8 text | got byte 0xe9: save as UTF-8"),
    ],
)
def test_what_is_not_toml_is_named_with_its_line(
    content: bytes, problem: str, error: type[FileProblem], tmp_path: Path
) -> None:
    path = tmp_path / "some.toml"
    path.write_bytes(content)
    with pytest.raises(error) as refusal:
        read_toml(path, error)
    assert refusal.value.problems == (problem,)
    assert str(refusal.value) == f"{path}: {problem}"


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"schema": 5}, ["schema | expected a valid string | got 5"]),
        ({"schema_id": "x"}, ["schema_id | expected one of the known keys (schema, time, inputs, pets, limits)"]),
        ({"inputs": [{"column": "a"}, {}]}, ["inputs.1.column | expected this key | got nothing"]),
        ({"inputs": [{"column": "a", "x": 1}]}, ["inputs.0.x | expected one of the known keys (column, scale)"]),
        ({"pets": {"tom": {"kind": "cat", "legs": 4}}}, ["pets.tom.lives | ", "pets.tom.legs | expected one of the"]),
        ({"pets": {"tom": {"kind": "cow"}}}, ["pets.tom.kind | expected one of 'cat', 'dog' | got 'cow'"]),
        ({"pets": {"tom": {}}}, ["pets.tom.kind | expected one of 'cat', 'dog' | got nothing: add it"]),
        ({"pets": {"tom": {"kind": "dog", "legs": {}}}}, ["pets.tom.legs | expected a valid integer | got a table"]),
        ({"limits": 5}, ["limits | expected "]),
        (
            {"limits": {"low": 0, "hihg": 1}},
            ["limits.high | expected this", "limits.hihg | expected one of the known keys (low, high)"],
        ),
        ({"limits": {"low": 2.0, "high": 1.0}}, ["limits.low | expected less than high | got 2.0", "limits.high | "]),
    ],
)
def test_a_fault_is_named_by_the_file_s_own_keys(data: dict[str, object], expected: list[str]) -> None:
    found = lines(data)
    assert len(found) == len(expected)
    for line, opening in zip(found, expected, strict=True):
        assert line.startswith(opening)


def test_a_list_of_tables_in_place_of_one_is_refused_in_words_of_toml() -> None:
    (line,) = lines({"limits": [{"low": 1.0, "high": 2.0}]})
    assert line == "limits | expected a table | got [{'low': 1.0, 'high': 2.0}]"
