"""What radios do not do is refused: in what is said of a radio, of rules over it, of events and requests for these."""

from __future__ import annotations

import re
from itertools import permutations
from typing import Final

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment, load_network
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.network.radios import lora_longest
from foosim.deployment.network.rules import Network
from foosim.deployment.schema import Deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.deployment.validate_network import BadEvent, event_text, rule_findings, unheeded
from tests.deployment.test_deployment_file import cases
from tests.links.offered import TABLE, deployment_of

EVERYBODY: Final = ("network.robots={'*': [r]}", "network.places={'*': [0 m, 0 m, 1 m]}")


def refusal(*sets: str) -> str:
    with pytest.raises(DeploymentError) as caught:
        deployment_of(*sets)
    return str(caught.value)


def test_a_network_by_itself_has_the_problems_of_its_radios() -> None:
    """As they are of a whole deployment, in the table of problems."""
    one = re.compile(r"network\.radios=(\{.*\})")
    radios = [(found[1], case) for case in cases() if len(case.sets) == 1 and (found := one.fullmatch(case.sets[0]))]
    assert len(radios) > 20
    for text, case in radios:
        if case.problems:
            with pytest.raises(DeploymentError, match=r"radios\.r"):
                load_network(f"network: {{radios: {text}}}", "t")
        else:
            assert load_network(f"network: {{radios: {text}}}", "t") is not None


def test_the_payloads_of_lora_are_as_long_as_its_spreading_factor_lets_them() -> None:
    for factor, longest in zip(range(7, 13), (222, 222, 115, 51, 51, 51), strict=True):
        made = deployment_of(f"network.radios={{r: {{preset: lora_eu868, spreading_factor: {factor}}}}}")
        assert made.network.radios["r"].payload_max == longest


def ruled(radio: str, rule: str, *sets: str) -> tuple[str, ...]:
    return (f"network.radios={{r: {{{radio}}}}}", f"network.links=[{{id: l, {rule}}}]", *EVERYBODY, *sets)


@pytest.mark.parametrize("via", ["via: r, ", ""])
@pytest.mark.parametrize(
    ("radio", "settings", "problem"),
    [
        ("preset: wifi_5_indoor", "rate: 6 Mbit/s", "links[0]: via r, has no effect over wifi: a radio's bit rate is"),
        ("preset: lora_eu868", "trace: {file: t}", "links[0]: via r, has no effect over lora"),
        ("preset: zigbee", "overhead: 9 B", "links[0]: via r, has no effect over ieee802154, whose headers"),
        ("preset: lora_eu868, spreading_factor: 12", "mtu: 52 B", "via r, more than the 51 B of LoRaWAN at spreading"),
    ],
)
def test_a_rule_is_obeyed_by_the_radio_that_it_goes_by(via: str, radio: str, settings: str, problem: str) -> None:
    assert problem in refusal(*ruled(radio, f"from: a, to: b, {via}{settings}"))
    key = settings.partition(":")[0]
    events = f"network.events=[{{at: 1 s, set: {{link: l, {settings}}}}}]"
    assert "events[0].set: via r" in refusal(*ruled(radio, f"from: a, to: b, {via}loss: 1 %", events))
    made = deployment_of(*ruled(radio, f"from: a, to: b, {via}loss: 1 %"))
    value = {"file": "t"} if key == "trace" else settings.partition(": ")[2]
    with pytest.raises(BadEvent, match=r"set: via r, "):
        event_text(made, {"set": {"link": "l", key: value}}, 10**9)


def test_a_rule_whose_packets_go_by_a_wire_has_a_rate() -> None:
    """Also where others of the same ends go by radio, by another rule."""
    radio = "network.radios={r: {preset: wifi_5_indoor}, w: {preset: wired_1g}}"
    wire = "{id: wire, from: a, to: b, via: w, rate: 1 Mbit/s}"
    behind = "{id: rest, from: a, to: b, rate: 1 Mbit/s}"
    carried = "network.robots={a: [r, w], b: [w], '*': [r]}"
    deployment_of(radio, carried, EVERYBODY[1], f"network.links=[{wire}, {behind}]")
    sets = "network.robots={a: [w], b: [w]}", f"network.links=[{wire}]", "network.links.wire.rate='2 Mbit/s'"
    deployment_of(radio, *sets)


# --- who is on air is somewhere ---------------------------------------------------------------------------------------


def test_the_links_of_the_console_are_ideal_and_need_no_radio_where_no_rule_names_it() -> None:
    """Whatever selectors match it by chance, radios and defaults there are."""
    console = "clients={desk: {console: true}, hand: {}}"
    radio = "network.radios={r: {preset: wifi_5_indoor}}", "network.robots={'*': [r]}"
    others = (
        "network.defaults={preset: zigbee}",
        "network.places={hand: [0 m, 0 m, 1 m], camera: [0 m, 0 m, 1 m], '*.*': [0 m, 0 m, 1 m]}",
    )
    lossy = "{id: all, from: '*', to: '*', loss: 50 %}"
    profiles = deployment_of(console, *radio, *others, f"network.links=[{lossy}]").profiles()
    pairs = ("desk", "camera"), ("camera", "desk"), ("hand", "camera")
    assert [profiles.find(*pair, "x").rule for pair in pairs] == ["ideal", "ideal", "all"]
    assert [*profiles.rules_for(*pairs[0])] == [None]
    named = f"network.links=[{lossy}, {{id: cable, between: [desk, '*'], delay: 5 ms}}]"
    profiles = deployment_of(console, *radio, others[1], named).profiles()
    assert [profiles.find(*pair, "x").rule for pair in pairs] == ["cable", "cable", "all"]
    assert profiles.find(*pairs[0], "x").radio == "", "it carries no radio"
    with pytest.raises(DeploymentError, match=r"radio r, but is nowhere: write network\.places\.desk"):
        deployment_of(console, radio[0], "network.robots={desk: [r]}")


def test_a_partition_has_two_groups() -> None:
    what = "network.events[0].partition: fewer than two groups, as in [[a, b], [rest]], a list of 1"
    assert what in refusal("network.events=[{at: 1 s, partition: [[camera]]}]")
    made: Deployment = load_deployment(apply_sets(TABLE.read_text(), "t", []), "t")
    with pytest.raises(BadEvent, match="partition: fewer than two groups"):
        event_text(made, {"partition": [["camera"]]}, 10**9)


ENDS = ["a1", "a2", "b1", "b2", "c1"]
SIDES = st.lists(st.sampled_from(["a*", "b*", "*1", "c1", "*"]), min_size=1, max_size=2)
RULES = st.lists(
    st.tuples(SIDES, SIDES, st.sampled_from(["mtu: 200 B", "rate: 1 Mbit/s", "overhead: 1 B", ""])), max_size=3
)
CARRIED = st.dictionaries(
    st.sampled_from(["a*", "b1", "*2", "*"]), st.lists(st.sampled_from(["w", "l", "x"]), max_size=2)
)


@given(
    RULES,
    CARRIED,
    st.dictionaries(st.sampled_from(ENDS), st.sampled_from(["a1", "b2", "r"])),
    st.sampled_from(["", *ENDS]),
    st.booleans(),
)
@example([(["*"], ["*"], "rate: 1 Mbit/s")], {}, {}, "a1", True)
def test_one_pair_of_each_kind_says_what_all_pairs_say(
    rules: list[tuple[list[str], list[str], str]],
    carried: dict[str, list[str]],
    on: dict[str, str],
    console: str,
    is_radio: bool,
) -> None:
    links = [f"{{id: l{n}, from: {source}, to: {target}, {keys}}}" for n, (source, target, keys) in enumerate(rules)]
    radios = "w: {preset: wifi_5_indoor}, l: {preset: lora_eu868, spreading_factor: 9}, x: {preset: wired_1g}"
    defaults = "{preset: zigbee}" if is_radio else "{}"
    text = f"network: {{defaults: {defaults}, radios: {{{radios}}}, robots: {carried}, links: [{', '.join(links)}]}}"
    tree, problems = read_tree(text, locate_in("t"))
    assert tree is not None and not problems
    network = Network.model_validate(plain(tree)["network"])
    profiles = Profiles(network, on, console)
    on_air = any(profiles.base(way).is_on_air for way in ("", *network.radios))
    refused: dict[tuple[int | str, int | str], set[str]] = {}
    for number, rule in enumerate(network.links):
        for source, target in permutations(ENDS, 2) if on_air else ():
            way = profiles.way(rule, source, target) if rule in profiles.rules_for(source, target) else None
            radio = None if way is None else profiles.base(way)
            for key in ("rate", "mtu", "overhead") if radio is not None else ():
                is_heeded = unheeded(key, radio.medium) is None  # type: ignore[union-attr]
                if key == "mtu" and radio is not None and radio.medium == "lora":
                    is_heeded = (rule.payload_max or 0) <= (lora_longest(radio.spreading_factor) or 0)
                if f"{key}:" in links[number] and not is_heeded:
                    refused.setdefault((number, key), set()).add(way or network.defaults.preset)
    found = {(finding.location[2], finding.location[3]): finding for finding in rule_findings(profiles, ENDS)}
    assert found.keys() == refused.keys()
    for place, finding in found.items():
        assert finding.what.partition(",")[0].removeprefix("via ") in refused[place]
