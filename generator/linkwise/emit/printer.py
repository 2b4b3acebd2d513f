"""One node to text, in the syntax of each target language."""

from linkwise.expression.graph import Entry

ATOM, PRODUCT, SUM = 3, 2, 1
Text = tuple[str, int]
"""Code and its precedence: ATOM binds tightest."""


class Printer:
    """Infix arithmetic, as Python and C share it; a subclass says how constants and functions look."""

    def constant(self, value: float) -> str:
        """Text of a number; repr keeps every digit."""
        return repr(value)

    def function(self, name: str) -> str:
        """Text of a function's name."""
        raise NotImplementedError

    def print(self, entry: Entry, operands: tuple[Text, ...]) -> Text:
        """Text of one node from its operands' texts; an unknown kind of node raises AttributeError."""
        return getattr(self, f"_{entry[0]}")(entry, operands)  # type: ignore[no-any-return]

    def _const(self, entry: Entry, _: tuple[Text, ...]) -> Text:
        value = entry[1]
        return self.constant(value), ATOM if value >= 0 else SUM

    def _symbol(self, entry: Entry, _: tuple[Text, ...]) -> Text:
        return entry[1], ATOM

    def _add(self, _: Entry, operands: tuple[Text, ...]) -> Text:
        (a, _pa), (b, pb) = operands
        return f"{a} + {_wrap(b, pb, SUM) if b.startswith('-') else b}", SUM

    def _sub(self, _: Entry, operands: tuple[Text, ...]) -> Text:
        (a, _pa), (b, pb) = operands
        return f"{a} - {_wrap(b, pb, PRODUCT)}", SUM

    def _mul(self, _: Entry, operands: tuple[Text, ...]) -> Text:
        (a, pa), (b, pb) = operands
        return f"{_wrap(a, pa, PRODUCT)} * {_wrap(b, pb, ATOM)}", PRODUCT

    def _div(self, _: Entry, operands: tuple[Text, ...]) -> Text:
        (a, pa), (b, pb) = operands
        return f"{_wrap(a, pa, PRODUCT)} / {_wrap(b, pb, ATOM)}", PRODUCT

    def _neg(self, _: Entry, operands: tuple[Text, ...]) -> Text:
        ((a, pa),) = operands
        return f"-{_wrap(a, pa, PRODUCT)}", SUM

    def _call(self, entry: Entry, operands: tuple[Text, ...]) -> Text:
        return f"{self.function(entry[1])}({operands[0][0]})", ATOM


class PythonPrinter(Printer):
    """Calls into an array library, such as `np`, `torch` or the argument `xp`."""

    def __init__(self, library: str) -> None:
        self.library = library

    def function(self, name: str) -> str:
        """Text of a function of the library."""
        return f"{self.library}.{name}"


class CPrinter(Printer):
    """C99 over the type `real`: literals in R(), functions in F(), which the float version redefines."""

    def constant(self, value: float) -> str:
        """Text of a number in R()."""
        return f"R({value!r})" if value >= 0 else f"-R({-value!r})"

    def function(self, name: str) -> str:
        """Text of a function in F()."""
        return f"F({name})"


def _wrap(text: str, precedence: int, needed: int) -> str:
    return text if precedence >= needed else f"({text})"
