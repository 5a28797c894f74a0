"""Reads Structured Text into the typed tree; whatever the standard would refuse, or leaves open, is refused.

Checked here, as a PLC's compiler does: every name is declared, once (case is not told), and no word of the standard;
constants and loop counters are not written to; REAL and INT are never mixed without a conversion; calls name inputs
that there are.
"""

from __future__ import annotations

from tests.export.iec.tokens import NotStructuredText, Token, tokens
from tests.export.iec.tree import (
    INTEGERS,
    REALS,
    Assign,
    Block,
    Call,
    Exit,
    Expression,
    For,
    If,
    Statement,
    Variable,
)

LEVELS = (("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/"))
"""Binary operators, weakest first (IEC 61131-3, table 52)."""

IN_C = {"OR": "|", "AND": "&", "=": "==", "<>": "!="}


class Parser:
    """Recursive descent; one method per rule of the grammar."""

    def __init__(self, text: str) -> None:
        self._tokens = [*tokens(text), Token("end", "", text.count("\n"))]
        self._place = 0
        self._blocks: dict[str, Block] = {}
        self._block = Block("")
        self._counters: list[str] = []

    def blocks(self) -> dict[str, Block]:
        """Return every function block of the text, by name."""
        while self._now.kind != "end":
            self._take("FUNCTION_BLOCK")
            self._block = Block(self._name())
            while self._now.text in ("VAR", "VAR_INPUT", "VAR_OUTPUT"):
                self._declarations()
            self._block.body = self._statements("END_FUNCTION_BLOCK")
            self._blocks[self._block.name.lower()] = self._block
        return {block.name: block for block in self._blocks.values()}

    # tokens

    @property
    def _now(self) -> Token:
        return self._tokens[self._place]

    def _next(self) -> Token:
        self._place += 1
        return self._tokens[self._place - 1]

    def _take(self, text: str) -> None:
        token = self._next()
        if token.text != text:
            raise NotStructuredText(f"line {token.line}: expected {text}, came {token.text!r}")

    def _took(self, text: str) -> bool:
        if self._now.text != text:
            return False
        self._place += 1
        return True

    def _name(self) -> str:
        token = self._next()
        if token.kind != "name":
            raise NotStructuredText(f"line {token.line}: expected a name, came {token.text!r}")
        return token.text

    def _require(self, fits: bool, wrong: str) -> None:
        if not fits:
            raise NotStructuredText(f"line {self._now.line}: {wrong}")

    # declarations

    def _declarations(self) -> None:
        section = self._next().text
        constant = self._took("CONSTANT")
        while not self._took("END_VAR"):
            name = self._name()
            self._take(":")
            bounds = self._bounds() if self._took("ARRAY") else ()
            type_name = self._next().text
            self._require(type_name in ("BOOL", *INTEGERS, *REALS) or type_name.lower() in self._blocks, type_name)
            initial = self._initial(type_name) if self._took(":=") else ()
            self._take(";")
            self._require(name.lower() not in self._block.variables, f"{name} is declared twice")
            self._require(bool(initial) or not constant, f"constant {name} has no value")
            self._block.variables[name.lower()] = Variable(
                name, type_name, bounds, initial, constant, section == "VAR_INPUT"
            )

    def _bounds(self) -> tuple[tuple[int, int], ...]:
        self._take("[")
        found = []
        while True:
            low = int(self._next().text)
            self._take("..")
            found.append((low, int(self._next().text)))
            self._require(found[-1][0] <= found[-1][1], "an array without elements")
            if self._took("]"):
                self._take("OF")
                return tuple(found)
            self._take(",")

    def _initial(self, type_name: str) -> tuple[str, ...]:
        if not self._took("["):
            return (self._literal(type_name),)
        values = [self._literal(type_name)]
        while self._took(","):
            values.append(self._literal(type_name))
        self._take("]")
        return tuple(values)

    def _literal(self, type_name: str) -> str:
        value = self._typed(self._unary(), type_name)
        return value.c

    # statements

    def _statements(self, *ends: str) -> tuple[Statement, ...]:
        found: list[Statement] = []
        while self._now.text not in ends:
            found.append(self._statement())
        if len(ends) == 1:
            self._take(ends[0])
        return tuple(found)

    def _statement(self) -> Statement:
        if self._took("IF"):
            return self._if()
        if self._took("FOR"):
            return self._for()
        if self._took("EXIT"):
            self._require(bool(self._counters), "EXIT outside a loop")
            self._take(";")
            return Exit()
        variable = self._variable(self._name())
        if self._took("("):
            return self._call(variable)
        self._require(not variable.constant and not variable.is_input, f"{variable.name} is not to be written")
        self._require(variable.name.lower() not in self._counters, f"loop counter {variable.name} is written")
        target = self._element(variable)
        self._take(":=")
        value = self._typed(self._expression(), target.type)
        self._take(";")
        return Assign(target, value)

    def _if(self) -> If:
        branches: list[tuple[Expression | None, tuple[Statement, ...]]] = []
        while True:
            condition = self._typed(self._expression(), "BOOL")
            self._take("THEN")
            branches.append((condition, self._statements("ELSIF", "ELSE", "END_IF")))
            if self._took("ELSIF"):
                continue
            if self._took("ELSE"):
                branches.append((None, self._statements("END_IF")))
            else:
                self._take("END_IF")
            return If(tuple(branches))

    def _for(self) -> For:
        counter = self._variable(self._name())
        self._require(counter.type in INTEGERS and not counter.bounds, f"loop counter {counter.name}")
        self._take(":=")
        first = self._typed(self._expression(), counter.type)
        self._take("TO")
        last = self._typed(self._expression(), counter.type)
        step = 1
        if self._took("BY"):
            self._take("-")
            self._take("1")
            step = -1
        self._take("DO")
        self._require(counter.name.lower() not in self._counters, f"loop counter {counter.name} twice")
        self._counters.append(counter.name.lower())
        body = self._statements("END_FOR")
        self._counters.pop()
        return For(counter.name, first, last, step, body)

    def _call(self, instance: Variable) -> Call:
        called = self._blocks[instance.type.lower()]
        given: list[tuple[str, Expression]] = []
        while not self._took(")"):
            name = self._name()
            parameter = called.variables.get(name.lower())
            self._require(parameter is not None and parameter.is_input, f"{called.name} has no input {name}")
            self._take(":=")
            if parameter is not None and parameter.bounds:
                given.append((name, self._whole_array(parameter)))
            else:
                given.append((name, self._typed(self._expression(), parameter.type if parameter else "")))
            self._took(",")
        self._take(";")
        return Call(instance, tuple(given))

    def _whole_array(self, parameter: Variable) -> Expression:
        given = self._variable(self._name())
        fits = (given.type, given.bounds) == (parameter.type, parameter.bounds)
        self._require(fits, f"{given.name} is no array like {parameter.name}")
        return Expression(f"self->{given.name}", "array")

    # expressions

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
        self._require(boolean == (kind == "BOOL"), f"{operator} between {left.type} and {right.type}")
        is_test = boolean or operator in ("=", "<>", "<", ">", "<=", ">=")
        return Expression(f"({left.c} {IN_C.get(operator, operator)} {right.c})", "BOOL" if is_test else kind)

    def _common(self, left: Expression, right: Expression) -> str:
        for a, b in ((left, right), (right, left)):
            if a.type == b.type or (b.type == "int" and a.type in INTEGERS) or (b.type == "real" and a.type in REALS):
                return a.type
        raise NotStructuredText(f"line {self._now.line}: {left.type} beside {right.type} without a conversion")

    def _typed(self, value: Expression, kind: str) -> Expression:
        self._require(self._common(Expression("", kind), value) == kind, f"{value.type} where {kind} is due")
        return value

    def _unary(self) -> Expression:
        if self._took("-"):
            value = self._unary()
            self._require(value.type != "BOOL", "minus before BOOL")
            return Expression(f"(-{value.c})", value.type)
        if self._took("NOT"):
            return Expression(f"(!{self._typed(self._unary(), 'BOOL').c})", "BOOL")
        return self._primary()

    def _primary(self) -> Expression:
        token = self._next()
        if token.text == "(":
            inner = self._expression()
            self._take(")")
            return inner
        if token.kind in ("int", "real"):
            return Expression(f"NUMBER({token.text})" if token.kind == "real" else token.text, token.kind)
        if token.text in ("TRUE", "FALSE"):
            return Expression("1" if token.text == "TRUE" else "0", "BOOL")
        self._require(token.kind == "name", f"{token.text!r} in an expression")
        if token.text in ("ABS", "MAX", "MIN"):
            return self._function(token.text)
        return self._element(self._variable(token.text))

    def _function(self, name: str) -> Expression:
        self._take("(")
        values = [self._expression()]
        while self._took(","):
            values.append(self._expression())
        self._take(")")
        self._require(len(values) == (1 if name == "ABS" else 2), f"{name} of {len(values)} values")
        kind = self._common(values[0], values[-1])
        self._require(name != "ABS" or kind in REALS, "ABS of no real")
        return Expression(f"{name}({', '.join(value.c for value in values)})", kind)

    def _variable(self, name: str) -> Variable:
        variable = self._block.variables.get(name.lower())
        self._require(variable is not None, f"{name} is not declared")
        return variable or Variable("", "")

    def _element(self, variable: Variable) -> Expression:
        """Return a variable, an element of an array, or an output of a block that is held."""
        if self._took("."):
            member = self._blocks[variable.type.lower()].variables[self._name().lower()]
            return self._place_in(f"self->{variable.name}.{member.name}", member)
        return self._place_in(f"self->{variable.name}", variable)

    def _place_in(self, c: str, variable: Variable) -> Expression:
        if not variable.bounds:
            return Expression(c, variable.type)
        self._take("[")
        for number, (low, high) in enumerate(variable.bounds):
            if number:
                self._take(",")
            index = self._typed(self._expression(), "INT")
            c += f"[AT({index.c}, {low}, {high})]"
        self._take("]")
        return Expression(c, variable.type)
