"""What every rule of the grammar needs: the token that is due, and a refusal that names its line."""

from tests.export.iec.tokens import NotStructuredText, Token, tokens
from tests.export.iec.tree import Block, Shape, Variable


class Reader:
    """The tokens of a text, and what has been declared so far."""

    def __init__(self, text: str) -> None:
        self._tokens = [*tokens(text), Token("end", "", text.count("\n") + 1)]
        self._place = 0
        self._types: dict[str, Shape] = {}
        self._blocks: dict[str, Block] = {}
        self._block = Block("")

    @property
    def _now(self) -> Token:
        return self._tokens[self._place]

    def _next(self) -> Token:
        token = self._now
        self._require(token.kind != "end", "the text ends here")
        self._place += 1
        return token

    def _take(self, text: str) -> None:
        self._require(self._now.text == text, f"expected {text}, got {self._now.text!r}")
        self._next()

    def _took(self, text: str) -> bool:
        if self._now.text != text:
            return False
        self._place += 1
        return True

    def _name(self) -> str:
        self._require(self._now.kind == "name", f"expected a name, got {self._now.text!r}")
        return self._next().text

    def _integer(self) -> int:
        sign = -1 if self._took("-") else 1
        self._require(self._now.kind == "int", f"expected a whole number, got {self._now.text!r}")
        return sign * int(self._next().text)

    def _variable(self) -> Variable:
        name = self._name()
        variable = self._block.variables.get(name.lower())
        if variable is None:
            raise NotStructuredText(f"line {self._now.line}: {name} is not declared")
        return variable

    def _called(self, instance: Variable) -> Block:
        block = self._blocks.get(instance.shape.element.lower())
        if block is None:
            raise NotStructuredText(f"line {self._now.line}: {instance.name} is no function block")
        return block

    def _require(self, fits: bool, wrong: str) -> None:
        if not fits:
            raise NotStructuredText(f"line {self._now.line}: {wrong}")
