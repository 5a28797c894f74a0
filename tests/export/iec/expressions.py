"""Expressions: precedence as in table 52 of the standard, types never mixed without a conversion.

Source: IEC 61131-3, edition 2, annex B.3.1.
"""

from tests.export.iec.reader import Reader
from tests.export.iec.tokens import NotStructuredText
from tests.export.iec.tree import INTEGERS, REALS, Expression, Variable

LEVELS = (("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/"))
"""Binary operators, weakest first."""

IN_C = {"OR": "|", "AND": "&", "=": "==", "<>": "!="}

WIDEST = {"INT": 2**15, "DINT": 2**31}
"""One above the largest value."""


class Expressions(Reader):
    """One method per rule of the grammar."""

    def _expression(self, level: int = 0) -> Expression:
        if level == len(LEVELS):
            return self._unary()
        left = self._expression(level + 1)
        while self._now.text in LEVELS[level]:
            operator = self._next().text
            left = self._binary(operator, left, self._expression(level + 1))
        return left

    def _binary(self, operator: str, left: Expression, right: Expression) -> Expression:
        kind = self._common(left, right)
        boolean = operator in ("OR", "AND")
        compares = operator in ("=", "<>", "<", ">", "<=", ">=")
        self._require(
            operator in ("=", "<>") or boolean == (kind == "BOOL"), f"{operator} between {left.type} and {right.type}"
        )
        text = f"({left.c} {IN_C.get(operator, operator)} {right.c})"
        return Expression(text, "BOOL" if boolean or compares else kind)

    def _common(self, left: Expression, right: Expression) -> str:
        for a, b in ((left, right), (right, left)):
            if a.type == b.type or (b.type == "int" and a.type in INTEGERS) or (b.type == "real" and a.type in REALS):
                self._require_room(b, a.type)
                return a.type
        raise NotStructuredText(f"line {self._now.line}: {left.type} and {right.type} without a conversion")

    def _require_room(self, value: Expression, kind: str) -> None:
        if value.literal is not None and kind in WIDEST:
            fits = -WIDEST[kind] <= value.literal < WIDEST[kind]
            self._require(fits, f"{value.literal} is beyond {kind}")

    def _typed(self, value: Expression, kind: str) -> Expression:
        self._require(self._common(Expression("", kind), value) == kind, f"{value.type} where {kind} is due")
        return value

    def _unary(self) -> Expression:
        """One operator at most: the grammar has no ``NOT NOT a``, no ``- -a``."""
        if self._took("-"):
            value = self._primary()
            self._require(value.type != "BOOL", "minus before BOOL")
            return Expression(f"(-{value.c})", value.type, None if value.literal is None else -value.literal)
        if self._took("NOT"):
            return Expression(f"(!{self._typed(self._primary(), 'BOOL').c})", "BOOL")
        return self._primary()

    def _primary(self) -> Expression:
        if self._took("("):
            inner = self._expression()
            self._take(")")
            return inner
        token = self._now
        if token.kind == "name":
            return self._element(self._variable())
        self._next()
        if token.kind == "int":
            return Expression(token.text, "int", int(token.text))
        if token.kind == "real":
            return Expression(f"NUMBER({token.text})", "real")
        if token.text in ("TRUE", "FALSE"):
            return Expression("1" if token.text == "TRUE" else "0", "BOOL")
        self._require(token.kind == "function", f"{token.text!r} in an expression")
        return self._function(token.text)

    def _function(self, name: str) -> Expression:
        self._take("(")
        value = self._expression()
        self._take(")")
        self._require(value.type in REALS, f"{name} of {value.type}")
        return Expression(f"{name}({value.c})", value.type)

    def _element(self, variable: Variable) -> Expression:
        """Return a variable, an element of an array, or a parameter of a block that is held."""
        if not self._took("."):
            return self._place_in(f"self->{variable.name}", variable)
        name = self._name()
        member = self._called(variable).variables.get(name.lower())
        if member is None or member.section not in ("VAR_INPUT", "VAR_OUTPUT"):
            raise NotStructuredText(f"line {self._now.line}: {variable.name} has no parameter {name}")
        return self._place_in(f"self->{variable.name}.{member.name}", member)

    def _place_in(self, c: str, variable: Variable) -> Expression:
        shape = variable.shape
        self._require(shape.element.lower() not in self._blocks, f"{variable.name} is a function block, no value")
        if not shape.bounds:
            return Expression(c, shape.element)
        self._take("[")
        for number, (low, high) in enumerate(shape.bounds):
            if number:
                self._take(",")
            index = self._typed(self._expression(), "INT")
            self._require(index.literal is None or low <= index.literal <= high, f"{variable.name}[{index.literal}]")
            c += f"[AT({index.c}, {low}, {high})]"
        self._take("]")
        return Expression(c, shape.element)
