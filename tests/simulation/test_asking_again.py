"""What is lost is asked for again, and only who is asked says it again."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Part, Want
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import rehearse
from foosim.simulation.settings import Settings, Traced

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS = 40
SEED = 5


def test_only_the_node_whose_part_is_lost_says_it_again() -> None:
    said: set[bytes] = set()
    asked: Counter[tuple[str, int]] = Counter()
    again: Counter[str] = Counter()

    def watch(traced: Traced) -> None:
        if traced.what == "receive" and traced.channel == channels.WANT.name:
            want = decode(Want, traced.payload)
            if want.kind == channels.PART.name:
                assert want.of and want.sender not in want.of
                asked[traced.process, want.tick] += traced.process in want.of
        elif traced.what == "publish" and traced.channel == channels.PART.name:
            part = decode(Part, traced.payload)
            if traced.payload in said:
                again[part.node] += 1
                asked[part.node, part.tick] -= 1
                assert asked[part.node, part.tick] >= 0, f"{part.node} says part {part.tick} again, and nobody asked it"
            said.add(traced.payload)

    weather = Weather(SEED, loss=0.1)
    sets = ["engine=pure", "substeps=1", "deadlines.tick_lost=5 s"]
    result = rehearse(TABLE.read_text(), TABLE.name, TICKS, 4, sets, Settings(weather=weather, observer=watch))
    assert result.json["ticks"] == TICKS
    print(f"seed {SEED}: parts said again {dict(again)}")
    assert len(again) == 4
