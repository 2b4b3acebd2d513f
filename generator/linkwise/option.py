"""Options: each is declared once, on the field of the dataclass that it fills.

Commands make flags of these fields, and a study's file has keys of the same names; Python gives the values.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

from linkwise.errors import LinkwiseError

T = TypeVar("T")
OPTION = "option"
"""Key of a field's metadata."""
REQUIRED: Any = MISSING
"""Default of an option that must be given."""


@dataclass(frozen=True)
class Option:
    """Declaration of a field's option, beside type and default.

    flag: spelling of the flag, by default that of the field's name
    key: key that is not the flag's, as `from` cannot be one
    read: makes the field's value of the texts that were written
    needs: flag, or flag and value, without which this option has no meaning; nothing is its default then
    is_file: whether texts of the field are paths of files
    is_key: whether a study's file has it as a key
    """

    help: str
    flag: str = ""
    metavar: str | None = None
    read: Callable[[tuple[str, ...]], Any] | None = None
    needs: str = ""
    is_file: bool = False
    is_key: bool = True
    key: str = ""

    def key_of(self, name: str) -> str:
        """Return the key of the field of this name."""
        return self.key or _key(self.flag or name)


class Written(NamedTuple):
    """An option as it is written: its key, and the type and the default of what is written."""

    key: str
    kind: Any
    default: Any
    option: Option

    @property
    def flag(self) -> str:
        """Spelling of the flag."""
        return self.option.flag or flag_of(self.key)


def option(default: T, help: str, flag: str = "", **more: Any) -> T:
    """Return the field of an option, as `dataclasses.field` does; REQUIRED is for one without a default."""
    usual: Any = {"default_factory": dict} if default == {} else {"default": default}
    made: T = field(**usual, metadata={OPTION: Option(help, flag, **more)})
    return made


def flag_of(key: str) -> str:
    """Return the flag of an option by its key."""
    return f"--{key.replace('_', '-')}"


def written(kind: type, is_optional: bool = False) -> Iterator[Written]:
    """Yield the options of a dataclass, and of those that its fields hold, in their order.

    is_optional: whether the dataclass is left out where its required options are not given
    """
    for own, hint, inner in _fields(kind):
        if inner is not None:
            yield from written(inner, inner is not hint)
        elif (declared := own.metadata.get(OPTION)) is not None:
            default = own.default
            if declared.read is not None:
                hint, default = tuple[str, ...], ()
            elif declared.needs or (is_optional and default is MISSING):
                hint, default = hint | None, None
            yield Written(declared.key_of(own.name), hint, default, declared)


def chosen(kind: type[T], given: Mapping[str, Any]) -> T:
    """Return a dataclass of the options that are given by their keys; None and empty lists are not given.

    Raises LinkwiseError for an option without the one that it needs, and for an invalid value.
    """
    options = [*written(kind)]
    for one in options:
        needed = one.option.needs
        flag, _, value = needed.partition(" ")
        found = given.get(_key(flag))
        is_met = not flag or (found == value if value else found is not None)
        if not is_met and given.get(one.key) is not None:
            several = [each.flag for each in options if each.option.needs == needed]
            verb = "go" if len(several) > 1 else "goes"
            raise LinkwiseError(f"{' and '.join(several)} {verb} with {needed}; add it")
    return _chosen(kind, given)


def _chosen(kind: type[T], given: Mapping[str, Any]) -> T:
    values = {}
    for own, _, inner in _fields(kind):
        if inner is not None:
            needed = (one for one in written(inner) if one.default is MISSING)
            if all(given.get(one.key) is not None for one in needed):
                values[own.name] = _chosen(inner, given)
        elif (declared := own.metadata.get(OPTION)) is not None:
            value = given.get(declared.key_of(own.name))
            if value not in (None, (), []):
                values[own.name] = _value(declared, value)
    return kind(**values)


def _value(declared: Option, value: Any) -> Any:
    if isinstance(value, (tuple, list)):
        texts = tuple(map(str, value)) if declared.is_file else tuple(value)
        return texts if declared.read is None else declared.read(texts)
    return str(value) if declared.is_file else value


def _fields(kind: Any) -> Iterator[tuple[Field[Any], Any, Any]]:
    """Yield each field of a dataclass, its type, and the dataclass whose options it holds, or None."""
    hints = get_type_hints(kind)
    for own in fields(kind):
        hint = hints[own.name]
        held = () if OPTION in own.metadata else filter(is_dataclass, (hint, *get_args(hint)))
        yield own, hint, next(iter(held), None)


def _key(flag: str) -> str:
    return flag.removeprefix("--").replace("-", "_")
