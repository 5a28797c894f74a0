"""Reads Structured Text into the typed tree; whatever the standard would refuse, or leaves open, is refused.

Checked here and in what it is built on, as a PLC's compiler does: every name is declared, before it is used, once (case
does not matter), and no word of the standard; constants, inputs and loop counters are not written to; types are never
mixed without a conversion; literals fit their type; calls name inputs that there are.

Source: IEC 61131-3, edition 2, annexes B.1.3, B.1.4 and B.1.5.
"""

from tests.export.iec.statements import Statements
from tests.export.iec.tree import ELEMENTARY, Block, Shape, Variable

SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT")


class Parser(Statements):
    """Recursive descent; one method per rule of the grammar."""

    def blocks(self) -> dict[str, Block]:
        """Return every function block and program of the text, by name."""
        while self._now.kind != "end":
            if self._took("TYPE"):
                self._type_declarations()
            else:
                self._pou()
        return {block.name: block for block in self._blocks.values()}

    def _type_declarations(self) -> None:
        self._require(self._now.text != "END_TYPE", "TYPE declares nothing")
        while not self._took("END_TYPE"):
            name = self._new_name()
            self._take(":")
            shape = self._array()
            self._types[name.lower()] = Shape(shape.element, shape.bounds, name)
            self._take(";")

    def _pou(self) -> None:
        kind = self._next().text
        self._require(kind in ("FUNCTION_BLOCK", "PROGRAM"), f"expected TYPE or a POU, got {kind!r}")
        self._block = Block(self._new_name(), kind == "PROGRAM")
        while self._now.text in SECTIONS:
            self._section()
        self._block.body = self._statements(f"END_{kind}")
        self._take(f"END_{kind}")
        self._blocks[self._block.name.lower()] = self._block

    def _new_name(self) -> str:
        name = self._name()
        self._require(name.lower() not in self._types | self._blocks, f"{name} is declared twice")
        return name

    def _section(self) -> None:
        section = self._next().text
        constant = section == "VAR" and self._took("CONSTANT")
        self._require(self._now.text != "END_VAR", f"{section} declares nothing")
        while not self._took("END_VAR"):
            self._declaration(section, constant)

    def _declaration(self, section: str, constant: bool) -> None:
        name = self._new_name()
        self._take(":")
        shape = self._array() if self._now.text == "ARRAY" else self._type()
        is_block = shape.element.lower() in self._blocks
        initial = self._initial(shape) if self._took(":=") else ()
        self._take(";")
        taken = (*self._block.variables, self._block.name.lower())
        self._require(name.lower() not in taken, f"{name} is declared twice")
        self._require(bool(initial) or not constant, f"constant {name} has no value")
        self._require(not is_block or (section == "VAR" and not initial), f"function block {name}")
        self._block.variables[name.lower()] = Variable(name, shape, section, constant, initial)

    def _type(self) -> Shape:
        name = self._next().text
        block = self._blocks.get(name.lower())
        known = name in ELEMENTARY or name.lower() in self._types or (block is not None and not block.is_program)
        self._require(known, f"{name} is no type that is declared above")
        return self._types.get(name.lower(), Shape(block.name if block else name))

    def _array(self) -> Shape:
        self._take("ARRAY")
        self._take("[")
        bounds = [self._subrange()]
        while self._took(","):
            bounds.append(self._subrange())
        self._take("]")
        self._take("OF")
        element = self._next().text
        self._require(element in ELEMENTARY, f"{element} in an array")
        return Shape(element, tuple(bounds))

    def _subrange(self) -> tuple[int, int]:
        low = self._integer()
        self._take("..")
        high = self._integer()
        self._require(low <= high, "an array without elements")
        return low, high

    def _initial(self, shape: Shape) -> tuple[str, ...]:
        if not shape.bounds:
            return (self._literal(shape.element),)
        self._require(len(shape.bounds) == 1, "values for an array of several dimensions")
        self._take("[")
        values = [self._literal(shape.element)]
        while self._took(","):
            values.append(self._literal(shape.element))
        self._take("]")
        self._require(len(values) <= shape.size, f"{len(values)} values for {shape.size} elements")
        return tuple(values)

    def _literal(self, kind: str) -> str:
        signed = self._tokens[self._place + (self._now.text == "-")]
        is_literal = signed.kind in ("int", "real") or self._now.text in ("TRUE", "FALSE")
        self._require(is_literal, f"expected a literal, got {self._now.text}")
        return self._typed(self._unary(), kind).c
