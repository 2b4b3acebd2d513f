"""Answers of calls of constraints by a back end's own functions, where it has them: one call of C, say."""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, Protocol, TypeVar, cast

from ..interface import Numbers

Method = TypeVar("Method", bound=Callable[..., Any])


class Answering(Protocol):
    """Constraints that may have functions of their back end."""

    def answered(self, call: str, motion: Sequence[object]) -> Sequence[Numbers] | None:
        """Return what the functions answer to this motion; None without any, or where they have no answer."""


def by_functions(record: Callable[..., object] | None = None) -> Callable[[Method], Method]:
    """Return a decorator for calls on motion: functions of this name answer them, else the method itself.

    record: type that holds an answer of several arrays; None for an answer of one
    """

    def decorated(method: Method) -> Method:
        name = method.__name__

        @wraps(method)
        def answer(self: Answering, *motion: object, **named: object) -> object:
            found = None if named else self.answered(name, motion)
            if found is None:
                return method(self, *motion, **named)
            return found[0] if record is None else record(*found)

        return cast(Method, answer)

    return decorated
