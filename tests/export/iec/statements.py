"""Statements; each ends with a semicolon, END_IF and END_FOR included, and no list of them is empty.

Source: IEC 61131-3, edition 2, annex B.3.2.
"""

from tests.export.iec.expressions import Expressions
from tests.export.iec.tokens import NotStructuredText
from tests.export.iec.tree import INTEGERS, Assign, Block, Call, Exit, Expression, For, If, Statement, Variable, While


class Statements(Expressions):
    """One method per rule of the grammar."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._counters: list[str] = []  # of the loops around

    def _statements(self, *ends: str) -> tuple[Statement, ...]:
        found: list[Statement] = []
        while self._now.text not in ends:
            found.append(self._statement())
            self._take(";")
        self._require(bool(found), f"no statement before {self._now.text}")
        return tuple(found)

    def _statement(self) -> Statement:
        if self._took("IF"):
            return self._if()
        if self._took("FOR"):
            return self._for()
        if self._took("WHILE"):
            return self._while()
        if self._took("EXIT"):
            self._require(bool(self._counters), "EXIT outside a loop")
            return Exit()
        variable = self._variable()
        return self._call(variable) if self._took("(") else self._assignment(variable)

    def _assignment(self, variable: Variable) -> Assign:
        name = variable.name
        self._require(not variable.constant and variable.section != "VAR_INPUT", f"{name} is not to be written")
        self._require(name.lower() not in self._counters, f"loop counter {name} is written")
        self._require(self._now.text != ".", f"what {name} holds is not to be written")
        target = self._element(variable)
        self._take(":=")
        return Assign(target, self._typed(self._expression(), target.type))

    def _if(self) -> If:
        branches: list[tuple[Expression | None, tuple[Statement, ...]]] = []
        while True:
            condition = self._typed(self._expression(), "BOOL")
            self._take("THEN")
            branches.append((condition, self._statements("ELSIF", "ELSE", "END_IF")))
            if not self._took("ELSIF"):
                break
        if self._took("ELSE"):
            branches.append((None, self._statements("END_IF")))
        self._take("END_IF")
        return If(tuple(branches))

    def _for(self) -> For:
        counter = self._variable()
        name, kind = counter.name, counter.shape.element
        free = kind in INTEGERS and not counter.shape.bounds and not counter.constant and counter.section == "VAR"
        self._require(free and name.lower() not in self._counters, f"loop counter {name}")
        self._take(":=")
        first = self._typed(self._expression(), kind)
        self._take("TO")
        last = self._typed(self._expression(), kind)
        step = self._integer() if self._took("BY") else 1
        self._require(step != 0, "a loop that does not count")
        self._take("DO")
        self._counters.append(name.lower())
        body = self._statements("END_FOR")
        self._take("END_FOR")
        self._counters.pop()
        return For(name, first, last, step, body)

    def _while(self) -> While:
        condition = self._typed(self._expression(), "BOOL")
        self._take("DO")
        self._counters.append("")
        body = self._statements("END_WHILE")
        self._take("END_WHILE")
        self._counters.pop()
        return While(condition, body)

    def _call(self, instance: Variable) -> Call:
        called = self._called(instance)
        given: dict[str, Expression] = {}
        while not self._took(")"):
            if given:
                self._take(",")
            name, value = self._input(called)
            self._require(name not in given, f"input {name} is given twice")
            given[name] = value
        return Call(instance, tuple(given.items()))

    def _input(self, called: Block) -> tuple[str, Expression]:
        name = self._name()
        parameter = called.variables.get(name.lower())
        if parameter is None or parameter.section != "VAR_INPUT":
            raise NotStructuredText(f"line {self._now.line}: {called.name} has no input {name}")
        self._take(":=")
        if parameter.shape.bounds:
            return parameter.name, self._whole_array(parameter)
        return parameter.name, self._typed(self._expression(), parameter.shape.element)

    def _whole_array(self, parameter: Variable) -> Expression:
        """Return an array that is handed over; types are the same by their name, and unnamed ones never."""
        given = self._variable()
        same = given.shape.name != "" and given.shape.name == parameter.shape.name
        self._require(same, f"{given.name} is of another type than {parameter.name}: arrays need a named one")
        return Expression(f"self->{given.name}", "array")
