"""Text of one node, in the syntax of each target language."""

from linkwise.expression.expression_graph import Entry

ATOM, PRODUCT, SUM = 3, 2, 1
Text = tuple[str, int]
"""Code and its precedence: ATOM binds tightest."""


class Printer:
    """Infix arithmetic, shared by Python and C; a subclass says how constants and functions look."""

    def constant(self, value: float) -> str:
        """Return the text of a number that is not negative; repr keeps every digit."""
        return repr(value)

    def function(self, name: str) -> str:
        """Return the text of a function's name."""
        raise NotImplementedError

    def print(self, entry: Entry, operands: tuple[Text, ...]) -> Text:
        """Return the text of one node from its operands' texts; raises ValueError for an unknown kind."""
        match entry[0], operands:
            case "const", _:
                value: float = entry[1]
                return (self.constant(value), ATOM) if value >= 0 else (f"-{self.constant(-value)}", SUM)
            case "symbol", _:
                return entry[1], ATOM
            case "add", ((a, _), (b, pb)):
                return f"{a} + {_wrap(b, pb, SUM) if b.startswith('-') else b}", SUM
            case "sub", ((a, _), (b, pb)):
                return f"{a} - {_wrap(b, pb, PRODUCT)}", SUM
            case "mul", ((a, pa), (b, pb)):
                return f"{_wrap(a, pa, PRODUCT)} * {_wrap(b, pb, ATOM)}", PRODUCT
            case "div", ((a, pa), (b, pb)):
                return f"{_wrap(a, pa, PRODUCT)} / {_wrap(b, pb, ATOM)}", PRODUCT
            case "neg", ((a, pa),):
                return f"-{_wrap(a, pa, PRODUCT)}", SUM
            case "call", ((a, _),):
                return f"{self.function(entry[1])}({a})", ATOM
        raise ValueError(f"no text is known for a node {entry[0]!r} of {len(operands)} operands")


class PythonPrinter(Printer):
    """Printer of calls into an array namespace: `torch`, or `xp`, which stands for NumPy or torch."""

    def __init__(self, namespace: str) -> None:
        self.namespace = namespace

    def function(self, name: str) -> str:
        """Return the text of a function of the namespace; NumPy 2 and torch name all of them alike."""
        return f"{self.namespace}.{name}"


class CPrinter(Printer):
    """Printer of C99 over the type `real`.

    Literals stand in R(), functions in F(), which the float version redefines.
    """

    def constant(self, value: float) -> str:
        """Return the text of a number in R()."""
        return f"R({value!r})"

    def function(self, name: str) -> str:
        """Return the text of a function in F()."""
        return f"F({name})"


def _wrap(text: str, precedence: int, needed: int) -> str:
    return text if precedence >= needed else f"({text})"
