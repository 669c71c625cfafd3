"""Files of links: traces of capacity in the format of mahimahi, and tables of delays in that of netem.

A trace has a line for each time, in ms, at which 1500 bytes can leave. A table has whitespace separated integers, 8192
for a standard deviation; what follows a # is a comment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from foosim.deployment.network.impairments import Impairments, TableJitter, Trace
from foosim.deployment.network.rules import Network
from foosim.world.matter.mesh import AssetError, check_digest

NUMBERS_MAX: Final = 1_000_000


def read_opportunities(text: str) -> tuple[int, ...]:
    """Return the times in ms, ascending; raises ValueError, with the line, for an invalid trace."""
    times: list[int] = []
    for number, line in enumerate(text.split("\n"), 1):
        word = line.partition("#")[0].strip()
        if not word:
            continue
        if not (word.isascii() and word.isdigit()) or len(word) > 12:
            raise ValueError(f"line {number}: not a whole number of ms, {word[:32]!r}")
        if times and int(word) < times[-1]:
            raise ValueError(f"line {number}: {word} ms after {times[-1]} ms, times ascend")
        times.append(int(word))
        if len(times) > NUMBERS_MAX:
            raise ValueError(f"line {number}: more than {NUMBERS_MAX} lines")
    if not times or times[-1] == 0:
        raise ValueError("no time after 0 ms")
    return tuple(times)


def read_table(text: str) -> tuple[int, ...]:
    """Return the numbers of a table, ascending; raises ValueError, with the line, for an invalid table."""
    numbers: list[int] = []
    for number, line in enumerate(text.split("\n"), 1):
        for word in line.partition("#")[0].split():
            if not word.lstrip("-").isdigit() or not word.isascii() or len(word) > 12:
                raise ValueError(f"line {number}: not a whole number, {word[:32]!r}")
            numbers.append(int(word))
            if len(numbers) > NUMBERS_MAX:
                raise ValueError(f"line {number}: more than {NUMBERS_MAX} numbers")
    if len(numbers) < 2:
        raise ValueError("fewer than two numbers")
    return tuple(sorted(numbers))


def file_settings(network: Network) -> Iterator[tuple[str, TableJitter | Trace]]:
    """Yield every setting of a network that names a file, with its place in the deployment."""
    places: list[tuple[str, Impairments]] = [(f"radios.{name}", radio) for name, radio in network.radios.items()]
    places += [(f"links.{number}", rule) for number, rule in enumerate(network.links)]
    places += [(f"events.{number}.set", event.set) for number, event in enumerate(network.events) if event.set]
    for place, settings in places:
        if isinstance(settings.jitter, TableJitter):
            yield f"network.{place}.jitter", settings.jitter
        if settings.trace is not None:
            yield f"network.{place}.trace", settings.trace


def network_files(network: Network) -> dict[str, str | None]:
    """Return the files of links, each with the digest that is written beside it."""
    return {setting.file: setting.digest for _, setting in file_settings(network)}


def check_files(network: Network, files: Mapping[str, bytes]) -> None:
    """Read the files of all links; raises AssetError for a missing or invalid one, and for another digest."""
    for place, setting in file_settings(network):
        content = files.get(setting.file)
        if content is None:
            raise AssetError(f"{setting.file}: the file of {place} is missing")
        if setting.digest is not None:
            check_digest(setting.file, content, setting.digest)
        read = read_table if isinstance(setting, TableJitter) else read_opportunities
        try:
            read(content.decode("ascii"))
        except UnicodeDecodeError:
            raise AssetError(f"{setting.file}: not a text of plain ASCII") from None
        except ValueError as error:
            raise AssetError(f"{setting.file}: {error}") from None
