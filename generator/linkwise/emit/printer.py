"""Text of one node, in the syntax of each target language."""

import re

from linkwise.expression.expression_graph import Entry

ATOM, PRODUCT, SUM, COMPARISON = 3, 2, 1, 0
Text = tuple[str, float]
"""Code and its precedence: ATOM binds tightest."""
FUNCTIONS_OF_C = {"abs": "fabs"}
SIGNS = {"lt": "<", "le": "<="}
NUMBER = re.compile(r"-?[\d.e+-]+")


class Printer:
    """Infix arithmetic, shared by Python and C; a subclass says how constants and functions look."""

    def constant(self, value: float) -> str:
        """Return the text of a number that is not negative; repr keeps every digit."""
        return repr(value)

    def function(self, name: str) -> str:
        """Return the text of a function's name."""
        raise NotImplementedError

    def comparison(self, a: str, sign: str, b: str) -> str:
        """Return the text of a condition."""
        return f"{a} {sign} {b}"

    def choice(self, condition: str, then: str, other: str) -> str:
        """Return the text of a value where a condition is true, and another where not."""
        raise NotImplementedError

    def named(self, text: str, name: str) -> None:
        """Note the variable that a text becomes."""

    def print(self, entry: Entry, operands: tuple[Text, ...]) -> Text:
        """Return the text of one node from its operands' texts; raises ValueError for an unknown kind."""
        match entry[0], operands:
            case "const", _:
                value: float = entry[1]
                return (self.constant(value), ATOM) if value >= 0 else (f"-{self.constant(-value)}", SUM)
            case "symbol", _:
                return entry[1], ATOM
            case "add", ((a, _), (b, pb)):
                return f"{a} + {wrapped(b, pb, SUM) if b.startswith('-') else b}", SUM
            case "sub", ((a, _), (b, pb)):
                return f"{a} - {wrapped(b, pb, PRODUCT)}", SUM
            case "mul", ((a, pa), (b, pb)):
                return f"{wrapped(a, pa, PRODUCT)} * {wrapped(b, pb, ATOM)}", PRODUCT
            case "div", ((a, pa), (b, pb)):
                return f"{wrapped(a, pa, PRODUCT)} / {wrapped(b, pb, ATOM)}", PRODUCT
            case "neg", ((a, pa),):
                return f"-{wrapped(a, pa, PRODUCT)}", SUM
            case "call", ((a, _),):
                return f"{self.function(entry[1])}({a})", ATOM
            case ("atan2" | "pow") as name, ((a, _), (b, _)):
                return f"{self.function(name)}({a}, {b})", ATOM
            case ("lt" | "le") as op, ((a, _), (b, _)):
                return self.comparison(a, SIGNS[op], b), COMPARISON
            case "select", ((condition, _), (then, _), (other, _)):
                return self.choice(condition, then, other), ATOM
        raise ValueError(f"no text is known for a node {entry[0]!r} of {len(operands)} operands")


class PythonPrinter(Printer):
    """Printer of calls into an array namespace: `torch`, or `xp`, which stands for NumPy or torch."""

    def __init__(self, namespace: str) -> None:
        self.namespace = namespace
        self._compared: dict[str, str] = {}

    def function(self, name: str) -> str:
        """Return the text of a function of the namespace; NumPy 2 and torch name all of them alike."""
        return f"{self.namespace}.{name}"

    def comparison(self, a: str, sign: str, b: str) -> str:
        """Return the text of a condition, and keep what it compares."""
        text = super().comparison(a, sign, b)
        self._compared[text] = b if NUMBER.fullmatch(a) else a
        return text

    def named(self, text: str, name: str) -> None:
        """Keep what a condition compares that is a variable now."""
        if text in self._compared:
            self._compared[name] = self._compared[text]

    def choice(self, condition: str, then: str, other: str) -> str:
        """Return a call of `where`.

        Two numbers would not have the precision of the motion, so one of them becomes an array.
        """
        if NUMBER.fullmatch(then) and NUMBER.fullmatch(other):
            then = f"{self.namespace}.full_like({self._compared[condition]}, {then})"
        return f"{self.namespace}.where({condition}, {then}, {other})"


class CPrinter(Printer):
    """Printer of C99 over the type `real`.

    Literals stand in R(), functions in F(), which the float version redefines.
    """

    def constant(self, value: float) -> str:
        """Return the text of a number in R()."""
        return f"R({value!r})"

    def function(self, name: str) -> str:
        """Return the text of a function in F()."""
        return f"F({FUNCTIONS_OF_C.get(name, name)})"

    def choice(self, condition: str, then: str, other: str) -> str:
        """Return a conditional expression."""
        return f"({condition} ? {then} : {other})"


def wrapped(text: str, precedence: float, needed: float) -> str:
    """Return the text of an operand, in brackets if it binds less tightly than is needed."""
    return text if precedence >= needed else f"({text})"
