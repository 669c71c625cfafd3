"""The phase between sensor and player: where both act at fixed times, it adds to the delay of every packet.

Pure: used by `lint`, which has the delays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import gcd
from typing import Final

from foosim.common.units import format_ns
from foosim.deployment.network.radios import Radio
from foosim.deployment.schema import Deployment

SHARE_LEAST: Final = 0.2
"""Share of the mean age by the phase from which on it is reported."""

Ends = tuple[str, str, str]
"""A player, and the endpoint and channel that it receives."""
Phase = tuple[int, int, int]
"""In ticks: the age, its part by the delay, and the player's offset with which only the delay remains."""


def phase_warnings(deployment: Deployment, late_ns: Callable[[Radio], int]) -> dict[tuple[str, str], list[str]]:
    """Return the warnings about sensors and players in step, by rule and radio of their links.

    `late_ns` is the delay, by a link's settings, that all but few of its packets keep.
    """
    found: dict[tuple[str, str], dict[Phase, list[Ends]]] = {}
    for rule, phase, ends in _phases(deployment, late_ns):
        found.setdefault(rule, {}).setdefault(phase, []).append(ends)
    return {
        rule: [_text(phase, heard, deployment.tick_ns) for phase, heard in phases.items()]
        for rule, phases in found.items()
    }


def _phases(deployment: Deployment, late_ns: Callable[[Radio], int]) -> Iterator[tuple[tuple[str, str], Phase, Ends]]:
    """Yield the channels whose age the delay does not explain.

    A sample of tick s is there at s + a, with the delay a. The player acts at ticks that leave the remainder `own` by
    `period`, the sensor samples at ticks that leave `sampled` by `every`. With g their greatest common divisor, the
    newest sample has waited for (own - a - sampled) mod g ticks at the least, and for (every - g) / 2 more in the mean:
    the first is a matter of the phase alone.
    """
    profiles = deployment.profiles()
    tick_ns = deployment.tick_ns
    for name, player in deployment.players.items():
        if not player.lockstep or player.act != "period":
            continue
        period, own = deployment.turns(player)
        for source, channel in deployment.heard_by(name):
            robot = deployment.robots.get(source)
            if robot is None or channel not in robot.sensors:
                continue
            step, shift, turn = deployment.schedule(robot.sensors[channel])
            if turn % step:  # its readings are not as many ticks apart each time: it is in step with no player
                continue
            every = turn // step
            sampled = -(shift // step) % every
            profile = profiles.find(source, name, channel)
            delay = -(-late_ns(profile.settings) // tick_ns)
            common = gcd(period, every)
            waits = (own - delay - sampled) % common
            mean = delay + waits + (every - common) / 2
            if waits and waits >= SHARE_LEAST * mean:
                best = (own - waits) % period
                yield (profile.rule, profile.radio), (delay + waits, delay, best), (name, source, channel)


def _text(phase: Phase, heard: list[Ends], tick_ns: int) -> str:
    age, delay, best = (format_ns(ticks * tick_ns) for ticks in phase)
    player, source, channel = heard[0]
    players = len({name for name, _, _ in heard})
    players_text = f"{player} sees" if players == 1 else f"{player} and {players - 1} more see"
    channels = len({(endpoint, sent) for _, endpoint, sent in heard})
    source_text = f"{source} {channel}" + (f" and {channels - 1} more channels" if channels > 1 else "")
    return (
        f"{players_text} {source_text} {age} old, of which the delay explains {delay}: sensor and player are in step; "
        f"an offset of {best} of the player, or act: arrival, leaves {delay}"
    )
