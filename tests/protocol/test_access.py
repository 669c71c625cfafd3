"""Access control as it is generated: for every deployment, identity and key what a direct predicate says."""

from collections import defaultdict
from itertools import product
from pathlib import Path
from typing import Any, Final

import pytest
import yaml
import zenoh
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.protocol.access import access_control, access_to
from foosim.protocol.channels import ALIVE, CHANNELS, Plane
from foosim.protocol.identity import ROLES, identities_of
from foosim.runtime.transport.settings import holds
from tests.granted import may_be_present, may_hear, may_put, may_watch

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"

NAMES = st.sampled_from(["a", "a-b", "a_b", "b", "ab", "a-b-c", "request", "all", "node", "client", "order"])


def deployment(
    nodes: list[str],
    clients: list[str],
    operators: list[str],
    viewers: list[str] | None = None,
) -> Deployment:
    """The table with other names."""
    content = yaml.safe_load(read_deployment_text(TABLE))
    robots = [robot for node in content["nodes"].values() for robot in node["robots"]]
    content["nodes"] = {name: {"robots": robots if name == nodes[0] else []} for name in nodes}
    content["players"] = {}
    content["clients"] = {name: {} for name in clients}
    content["access"] = {"operators": operators, "viewers": viewers or []}
    return load_deployment(yaml.safe_dump(content), "test")


class Allowed:
    """What rules let one who connected do, as Zenoh reads them: what no rule names is denied."""

    def __init__(self, control: dict[str, Any], identity: str) -> None:
        assert control["enabled"] and control["default_permission"] == "deny"
        subjects = {its["id"] for its in control["subjects"] if identity in its.get("cert_common_names", ())}
        names = {rule for its in control["policies"] if subjects & set(its["subjects"]) for rule in its["rules"]}
        self._granted: dict[tuple[str, str], list[zenoh.KeyExpr]] = defaultdict(list)
        for rule in control["rules"]:
            assert rule["permission"] == "allow"
            for kind in product(rule["flows"], rule["messages"]) if rule["id"] in names else ():
                self._granted[kind] += map(zenoh.KeyExpr, rule["key_exprs"])

    def __call__(self, flow: str, message: str, key: zenoh.KeyExpr) -> bool:
        return any(granted.includes(key) for granted in self._granted[flow, message])


def keys(plane: Plane, names: list[str]) -> list[tuple[str, zenoh.KeyExpr]]:
    """Every key of a plane with each of these names in it, and some that are none."""
    known = {channel.key_for(name) for channel in CHANNELS if channel.plane is plane for name in names}
    present = {ALIVE[plane].replace("{name}", name) for name in names}
    found = sorted({*known, *present, *(f"{key}/more" for key in known), "foosim", "other/key"})
    return [(key, zenoh.KeyExpr(key)) for key in found]


@settings(max_examples=15, phases=[Phase.explicit, Phase.generate])  # an example is small already
@given(
    st.lists(NAMES, min_size=1, max_size=3, unique=True),
    st.lists(NAMES, max_size=3, unique=True),
    st.lists(NAMES, max_size=2, unique=True),
    st.lists(NAMES, max_size=2, unique=True),
)
def test_rules_say_what_the_predicate_says(
    nodes: list[str], clients: list[str], operators: list[str], viewers: list[str]
) -> None:
    clients = [f"c{name}" for name in clients]
    viewers = [name for name in viewers if name not in operators]
    made = deployment(nodes, clients, operators, viewers=viewers)
    fixed = ["vhub", "supervisor", "replay", "nobody"]
    names = [*nodes, *clients, *fixed, *(f"{name}.x1" for name in [*operators, *viewers, *nodes])]
    for plane in Plane:
        control = access_control(access_to(plane, made))
        here = {Plane.RADIO: "client.", Plane.REPLAY: "operator."}.get(plane, ("vhub", "node.", "operator.", "viewer."))
        for identity in [*identities_of(made), *(f"{role}.nobody" for role in ROLES)]:
            is_known = identity.startswith(here) and not identity.endswith("nobody")
            passes = Allowed(control, identity)
            for name, key in keys(plane, names):
                said = (is_known, identity, name)
                assert passes("ingress", "put", key) == (is_known and may_put(identity, name)), said
                assert passes("egress", "liveliness_token", key) == (is_known and may_watch(identity, name)), said
                assert passes("ingress", "liveliness_token", key) == (is_known and may_be_present(identity, name)), said
                if not name.endswith("/more"):  # below a key that is heard lies nothing
                    assert passes("egress", "put", key) == (is_known and may_hear(identity, name)), said
                    assert passes("ingress", "declare_subscriber", key) == (is_known and may_hear(identity, name)), said
                for message in ("delete", "query", "reply", "declare_queryable"):
                    assert not passes("ingress", message, key) and not passes("egress", message, key), said


def test_nobody_subscribes_to_more_than_it_hears() -> None:
    made = deployment(["red", "blue"], ["hand"], ["admin"], viewers=["desk"])
    for plane in Plane:
        control = access_control(access_to(plane, made))
        for identity in identities_of(made):
            for wide in ("**", "foosim/**", "foosim/*/**", "foosim/radio/**", "foosim/simulation/*", "@/**"):
                for message in ("declare_subscriber", "put", "query"):
                    assert not Allowed(control, identity)("ingress", message, zenoh.KeyExpr(wide)), (identity, wide)


def test_writers_are_told_that_readers_listen_as_those_declare_it() -> None:
    made = deployment(["red", "blue"], ["hand"], ["admin"], viewers=["desk"])
    readers = {
        "node.red": ["simulation/hello/*", "simulation/part/**", "simulation/samples/**", "simulation/want/*"],
        "vhub": ["simulation/deliveries/**", "simulation/heartbeat/*", "simulation/want/*"],
        "operator.admin": ["simulation/request/*", "simulation/inquiry/*", "simulation/fetch/*"],
        "viewer.desk": ["simulation/inquiry/*", "simulation/fetch/*"],
        "client.hand": ["radio/hello/*", "radio/up/*"],
    }
    for identity, declared in readers.items():
        plane = Plane.RADIO if identity.startswith("client.") else Plane.SIMULATION
        passes = Allowed(access_control(access_to(plane, made)), identity)
        for key in declared:
            assert passes("egress", "declare_subscriber", zenoh.KeyExpr(f"foosim/{key}")), (identity, key)
        assert not passes("egress", "declare_subscriber", zenoh.KeyExpr("foosim/simulation/build/blue"))
        if identity == "operator.admin":
            replay = Allowed(access_control(access_to(Plane.REPLAY, made)), identity)
            assert replay("egress", "declare_subscriber", zenoh.KeyExpr("foosim/replay/request/*"))
        assert not passes("egress", "declare_subscriber", zenoh.KeyExpr("foosim/radio/down/other"))


@pytest.mark.parametrize(
    ("found", "said", "same"),
    [
        ({"a": 1, "b": None}, {"a": 1}, True),
        ({"a": 1, "b": 2}, {"a": 1}, False),
        ({"a": 1}, {"a": 1, "b": 2}, False),
        ([{"a": None}], [{}], True),
        ([1, 2], [1], False),
        (None, None, True),
        (0, None, False),
    ],
)
def test_zenoh_holds_what_it_was_told(found: object, said: object, same: bool) -> None:
    assert holds(found, said) is same
