"""Prints the tree as C: a struct per function block, a function that starts it, a function that is its body.

``AT`` checks every index against the array's bounds and stops the program: what a PLC reports as a fault must not
pass here.
"""

from collections.abc import Iterator

from tests.export.iec.tree import Assign, Block, Call, Exit, For, If, Statement, Variable, While

TYPES = {"BOOL": "int8_t", "INT": "int16_t", "DINT": "int32_t", "LREAL": "double", "REAL": "float"}

HEAD = """#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#define NUMBER(x) ({real})(x)
#define ABS(x) fabs{f}(x)
#define SQRT(x) sqrt{f}(x)
#define LN(x) log{f}(x)
#define ATAN(x) atan{f}(x)
static inline int at(int i, int low, int high) {{ if (i < low || i > high) abort(); return i - low; }}
#define AT(i, low, high) at(i, low, high)
"""


def to_c(blocks: dict[str, Block]) -> str:
    """Return the program; NAME_start(self) puts a block into its first state, NAME(self) calls it."""
    kinds = {variable.shape.element for block in blocks.values() for variable in block.variables.values()}
    single = "REAL" in kinds
    lines = [HEAD.format(real="float" if single else "double", f="f" if single else "")]
    for block in blocks.values():
        lines += _block(block)
    return "\n".join(lines) + "\n"


def _block(block: Block) -> Iterator[str]:
    yield "typedef struct {"
    for variable in block.variables.values():
        sizes = "".join(f"[{high - low + 1}]" for low, high in variable.shape.bounds)
        yield f"  {TYPES.get(variable.shape.element, variable.shape.element)} {variable.name}{sizes};"
    yield f"}} {block.name};"
    yield f"void {block.name}_start({block.name} *self) {{"
    yield "  char *bytes = (char *)self; for (size_t i = 0; i < sizeof *self; i++) bytes[i] = 0;"
    for variable in block.variables.values():
        yield from _start(variable)
    yield "}"
    yield f"void {block.name}_call({block.name} *self) {{"
    yield from _statements(block.body)
    yield "}"


def _start(variable: Variable) -> Iterator[str]:
    kind = variable.shape.element
    if kind not in TYPES:
        yield f"  {kind}_start(&self->{variable.name});"
    for number, value in enumerate(variable.initial):
        yield f"  self->{variable.name}{f'[{number}]' if variable.shape.bounds else ''} = {value};"


def _statements(body: tuple[Statement, ...]) -> Iterator[str]:
    for statement in body:
        yield from _statement(statement)


def _statement(statement: Statement) -> Iterator[str]:
    match statement:
        case Assign(target, value):
            yield f"{target.c} = {value.c};"
        case Call(instance, inputs):
            for name, value in inputs:
                place = f"self->{instance.name}.{name}"
                is_array = value.type == "array"
                yield f"memcpy({place}, {value.c}, sizeof {place});" if is_array else f"{place} = {value.c};"
            yield f"{instance.shape.element}_call(&self->{instance.name});"
        case If(branches):
            for number, (condition, inner) in enumerate(branches):
                word = "else" if condition is None else f"{'else ' if number else ''}if ({condition.c})"
                yield f"{word} {{"
                yield from _statements(inner)
                yield "}"
        case For(counter, first, last, step, inner):
            test = "<=" if step > 0 else ">="
            name = f"self->{counter}"
            yield f"for ({name} = {first.c}; {name} {test} {last.c}; {name} += {step}) {{"
            yield from _statements(inner)
            yield "}"
        case While(condition, inner):
            yield f"while ({condition.c}) {{"
            yield from _statements(inner)
            yield "}"
        case Exit():
            yield "break;"
