"""Makes options of a command of the fields of a dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import wraps
from typing import Annotated, Any, get_args, get_type_hints


def with_options(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make command options of the fields of a command's dataclass parameter: of all, or of those in `names`.

    The fields have annotations of typer. For a parameter `X | None` the required fields of X may be left out on the
    command line; the command then gets None.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        parameters: list[inspect.Parameter] = []
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            kinds: list[Any] = [
                kind for kind in (parameter.annotation, *get_args(parameter.annotation)) if is_dataclass(kind)
            ]
            if not kinds:
                parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))
                continue
            (options,), name, may_lack = kinds, parameter.name, kinds[0] is not parameter.annotation
            taken = {field.name: field for field in fields(options) if not names or field.name in names}
            hints = get_type_hints(options, include_extras=True)
            parameters += [_parameter(field, hints[field.name], may_lack) for field in taken.values()]

        @wraps(command)
        def called(**given: Any) -> None:
            values = {field: given.pop(field) for field in taken}
            lacks = any(values[field.name] is None for field in taken.values() if field.default is MISSING)
            values = {field: tuple(value) if isinstance(value, list) else value for field, value in values.items()}
            command(**{name: None if lacks else options(**values)}, **given)

        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return called

    return decorate


def _parameter(field: Field[Any], hint: Any, may_lack: bool) -> inspect.Parameter:
    """Return the parameter for a field; for typer an option that may be repeated is a list."""
    kind, info = get_args(hint)
    default = field.default
    if kind == tuple[str, ...]:
        kind, default = list[str], []
    if default is MISSING:
        kind, default = (kind | None, None) if may_lack else (kind, inspect.Parameter.empty)
    kept = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(field.name, kept, default=default, annotation=Annotated[kind, info])
