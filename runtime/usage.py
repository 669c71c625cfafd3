"""Usage errors in one line: the command, the problem, the value, what is valid.

`command` prints them. Typer's exceptions for different problems share a class; their attributes distinguish them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer

from foosim.common.errors import BadValue, show
from foosim.common.names import nearest_name


class BadUsage(BadValue):
    """The command line is invalid: an unknown option or argument, or a bad value of one."""


def bad_usage(error: typer.TyperException, root: Any, program: str, words: Sequence[str]) -> BadUsage:
    """Return the error in `words`, which typer refused with `error`; `root` is the typer command of `program`."""
    command, place, words = _meant(error, root, program, words)
    option, parameter = getattr(error, "option_name", None), getattr(error, "param", None)
    if option is not None:
        if hasattr(error, "possibilities"):
            return _unknown(f"{place}: there is no such option", option, "options", _options(command))
        return _value_of_option(command, place, option, words)
    if parameter is None:
        return _arguments(command, error, place, words)
    if hasattr(error, "param_type"):
        needed = [_shown(one) for one in command.params if one.required]
        also = f"; needed are {', '.join(needed)}" if len(needed) > 1 else ""
        return BadUsage(f"{place}: {_shown(parameter)} is missing{also}")
    return _value(error, parameter, f"{place} {_shown(parameter)}")


def _meant(error: Exception, root: Any, program: str, words: Sequence[str]) -> tuple[Any, str, list[str]]:
    """Return the refused command, its name, and the words after its name."""
    command, names, context, left = root, [program], typer.Context(root, resilient_parsing=True), list(words)
    refusing = getattr(error, "ctx", None)
    depth = len(words) if refusing is None else len(_groups_above(refusing))
    while len(names) <= depth and hasattr(command, "list_commands"):
        place = next((place for place, word in enumerate(left) if not word.startswith("-")), len(left))
        name, found, after = command.resolve_command(context, left[place:]) if left[place:] else (None, None, [])
        if found is None:
            break
        command, left = found, after
        names.append(name)
    return command, " ".join(names), left


def _groups_above(context: Any) -> list[Any]:
    """Return the contexts of the groups that the command of a context is in."""
    return [] if context.parent is None else [context.parent, *_groups_above(context.parent)]


def _shown(parameter: Any) -> str:
    """Return the name of a parameter as in the docs: `--seed`, `COUNT`."""
    if parameter.param_type_name == "option":
        return str(max(parameter.opts, key=len))
    return str(parameter.metavar or parameter.name.upper())


def _options(command: Any) -> list[str]:
    return [_shown(one) for one in command.params if one.param_type_name == "option"] + ["--help"]


def _unknown(what: str, word: str, kind: str, valid: Sequence[str]) -> BadUsage:
    near = nearest_name(word, valid)
    return (
        BadUsage(what, word, near)
        if near is not None
        else BadUsage(f"{what}, {show(word)}; {kind} are {', '.join(valid)}")
    )


def _value_of_option(command: Any, place: str, option: str, words: Sequence[str]) -> BadUsage:
    """Return the error of an option with too few values, or of a flag with a value."""
    parameter = next(one for one in command.params if option in one.opts)
    where = f"{place} {option}"
    if getattr(parameter, "is_flag", False):
        given = next((word for word in words if word.startswith(f"{option}=")), option)
        return BadUsage(f"{where}: it takes no value", given.partition("=")[2])
    if parameter.nargs == 1:
        return BadUsage(f"{where}: its value is missing; of it --help says: {parameter.help}")
    behind = words[words.index(option) + 1 :] if option in words else []
    count = f"{where}: {parameter.nargs} values are needed, {parameter.metavar}; here are {len(behind)}"
    return BadUsage(count, " ".join(behind)) if behind else BadUsage(count)


def _value(error: Exception, parameter: Any, where: str) -> BadUsage:
    """A value that is not of its option's type."""
    problems: list[Any] = getattr(error.__cause__, "errors", list)()  # of pydantic, by which typer reads values
    if not problems or parameter.type_descriptor.annotation is not int:
        return BadUsage(f"{where}: {getattr(error, 'message', error)}")
    least, most = parameter.min, parameter.max
    span = "" if least is None else f" from {least} on" if most is None else f" from {least} to {most}"
    return BadUsage(f"{where}: a whole number{span} is needed", str(problems[0]["input"]))


def _arguments(command: Any, error: typer.TyperException, place: str, words: Sequence[str]) -> BadUsage:
    """A word that is no command, no command at all, or more words than there are arguments."""
    context = getattr(error, "ctx", None)
    if hasattr(command, "list_commands"):
        commands = command.list_commands(context)
        word = next((word for word in words if not word.startswith("-")), None)
        if word is None:
            return BadUsage(error.format_message())  # the help
        return _unknown(f"{place}: there is no such command", word, "commands", commands)
    extra = [] if context is None else command.make_parser(context).parse_args(list(words))[1]
    if not extra:
        return BadUsage(f"{place}: {error.format_message()}")
    taken = [_shown(one) for one in command.params if one.param_type_name == "argument"]
    if not taken:
        return BadUsage(f"{place}: it takes no arguments", " ".join(extra))
    return BadUsage(f"{place}: too many arguments, {show(' '.join(extra))}; it takes {' '.join(taken)}")
