"""Identities x keys x verbs on real sessions: nothing passes where nothing is granted, and what is granted passes.

Sessions are opened with the settings of the product and then driven through Zenoh itself, as somebody would who keeps
to no rules. Those who must not are heard before those who may, over the same links, which keep their order: when the
last granted message has come, what was not granted and has not come by then was stopped.
"""

import shutil
import socket
import ssl
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path
from typing import Any, Final

import pytest
import yaml
import zenoh

from foosim.common.addresses import parse_address
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.launcher import pki as certificates
from foosim.protocol.access import access_to
from foosim.protocol.channels import ALIVE, CHANNELS, Plane
from foosim.runtime.transport import session as wire
from foosim.runtime.transport.certificates import NotAuthorised, load_credentials
from foosim.runtime.transport.session import ConnectError, Session
from foosim.runtime.transport.settings import Security, client_settings, router_settings
from tests.granted import may_be_present, may_hear, may_put, may_watch
from tests.wire.conftest import TABLE, wait_for
from tests.wire.proxy import Proxy, Weather

LONG_S: Final = 900.0
INSIDERS: Final = {
    Plane.SIMULATION: ("node.red", "node.blue", "vhub", "operator.admin", "viewer.desk"),
    Plane.RADIO: ("client.hand", "client.other"),
    Plane.REPLAY: ("operator.admin",),
}
OUTSIDERS: Final = {
    Plane.SIMULATION: ("client.hand", "node.nobody", "operator.nobody", "viewer.nobody"),
    Plane.RADIO: ("node.red", "operator.admin", "client.nobody"),
    Plane.REPLAY: ("node.red", "client.hand", "operator.nobody", "viewer.desk"),
}
"""They have certificates of the same root."""
ROUTER: Final = {Plane.SIMULATION: "supervisor", Plane.RADIO: "vhub", Plane.REPLAY: "vhub"}
PRESENT: Final = {Plane.REPLAY: "replay"}
"""The name under which a router is present, where it is not its identity's: a replay shows the vHub's certificate."""
NAMES: Final = {
    Plane.SIMULATION: ("red", "blue", "nobody", "vhub", "supervisor", "admin.x1", "desk.x1", "nobody.x1"),
    Plane.RADIO: ("hand", "other", "nobody", "vhub", "red"),
    Plane.REPLAY: ("packets", "poses", "rows", "clock", "replay", "red", "admin.x1", "nobody.x1"),
}
BYTES_MAX: Final = 1 << 20


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A root, and a certificate for everybody in the matrix."""
    path = tmp_path_factory.mktemp("pki")
    certificates.init(path)
    everybody = {who for table in (INSIDERS, OUTSIDERS) for plane in Plane for who in table[plane]}
    certificates.issue(path, sorted({*everybody, "supervisor", "vhub"}))
    return path


@pytest.fixture(scope="module")
def deployment() -> Deployment:
    content = yaml.safe_load(read_deployment_text(TABLE))
    content |= {"players": {}, "clients": {"hand": {}, "other": {}}, "access": {"viewers": ["desk"]}}
    return load_deployment(yaml.safe_dump(content), "test")


def keys(plane: Plane) -> list[str]:
    """Every key of the plane, with every name."""
    return sorted({channel.key_for(name) for channel in CHANNELS if channel.plane is plane for name in NAMES[plane]})


def presences(plane: Plane) -> list[str]:
    return [ALIVE[plane].replace("{name}", name) for name in NAMES[plane]]


@dataclass
class Member:
    """A session with its identity, and what has come to it: (kind of subscriber, key, writer)."""

    identity: str
    session: zenoh.Session
    heard: set[tuple[str, str, str]] = field(default_factory=set)
    kept: list[Any] = field(default_factory=list)

    def subscribe(self, key: str) -> None:
        """Subscribe as anybody may try to; what this session says itself is left out."""

        def take(sample: zenoh.Sample) -> None:
            writer = sample.attachment.to_string() if sample.attachment is not None else ""
            if writer != self.identity:
                kind = "put" if sample.kind == zenoh.SampleKind.PUT else "delete"
                self.heard.add((kind, str(sample.key_expr), writer))

        self.kept.append(self.session.declare_subscriber(key, take))

    def watch(self, key: str) -> None:
        def take(sample: zenoh.Sample) -> None:
            self.heard.add(("alive", str(sample.key_expr), ""))

        self.kept.append(self.session.liveliness().declare_subscriber(key, take, history=True))

    def put_everywhere(self, plane: Plane) -> None:
        """Put on every key, those last on which it may, so that their arrival tells that the others had their turn."""
        for key in sorted(keys(plane), key=lambda key: may_put(self.identity, key)):
            self.session.put(key, b"x", attachment=self.identity)

    def delete_everywhere(self, plane: Plane) -> None:
        for key in keys(plane):
            self.session.delete(key, attachment=self.identity)


def opened(settings: dict[str, Any]) -> zenoh.Session:
    return wire._open(settings)


class World:
    """A plane with its router and everybody who tries."""

    def __init__(self, plane: Plane, folder: Path, deployment: Deployment, is_open: bool, stack: ExitStack) -> None:
        self.plane = plane
        self.folder = folder
        self._stack = stack
        credentials = load_credentials(folder, ROUTER[plane])
        assert credentials is not None
        security = Security(credentials, access_to(plane, deployment))
        settings = router_settings(parse_address("127.0.0.1", True), BYTES_MAX, security)
        if is_open:
            del settings["access_control"]
        self.router = self._kept(Member(ROUTER[plane], opened(settings)))
        self.address = parse_address(wire._locators(self.router.session)[0])
        self.members = [self.join(who) for who in (*OUTSIDERS[plane], *INSIDERS[plane])]

    def _kept(self, member: Member) -> Member:
        self._stack.callback(member.session.close)
        return member

    def join(self, who: str) -> Member:
        credentials = load_credentials(self.folder, who)
        assert credentials is not None
        settings = client_settings(self.address, BYTES_MAX, LONG_S, Security(credentials))
        return self._kept(Member(who, opened(settings)))

    @property
    def insiders(self) -> list[Member]:
        return [member for member in self.members if member.identity in INSIDERS[self.plane]]

    def is_inside(self, who: str) -> bool:
        return who in INSIDERS[self.plane]

    def subscribe_everywhere(self) -> None:
        """Everybody subscribes to each key, and to more than that; the router, who may, to all."""
        for member in self.members:
            for key in (*keys(self.plane), "foosim/**", "**"):
                member.subscribe(key)
        self.router.subscribe("foosim/**")

    def expected(self, is_open: bool) -> dict[str, set[tuple[str, str, str]]]:
        """What each hears of what all the others put."""
        everybody = [self.router.identity, *(member.identity for member in self.members)]
        router = self.router.identity
        found: dict[str, set[tuple[str, str, str]]] = {}
        for who in everybody:
            found[who] = {
                ("put", key, writer)
                for key in keys(self.plane)
                for writer in everybody
                if writer != who
                and (is_open or writer == router or (self.is_inside(writer) and may_put(writer, key)))
                and (is_open or who == router or (self.is_inside(who) and may_hear(who, key)))
            }
        return found


@pytest.fixture(params=list(Plane), ids=lambda plane: plane.name.lower())
def world(request: pytest.FixtureRequest, folder: Path, deployment: Deployment) -> Iterator[World]:
    with ExitStack() as stack:
        yield World(request.param, folder, deployment, False, stack)


def heard_all(world: World, expected: dict[str, set[tuple[str, str, str]]]) -> bool:
    return all(expected[member.identity] <= member.heard for member in (world.router, *world.members))


def put_all(world: World, expected: dict[str, set[tuple[str, str, str]]]) -> None:
    """Everybody puts everywhere, the router last, until what is granted has come: subscriptions take a moment."""

    def tried() -> bool:
        for member in (*world.members, world.router):
            member.put_everywhere(world.plane)
        return heard_all(world, expected)

    wait_for("what is granted", tried)


def test_puts_pass_where_they_are_granted_and_nowhere_else(world: World) -> None:
    world.subscribe_everywhere()
    for member in world.members:
        member.delete_everywhere(world.plane)
    expected = world.expected(is_open=False)
    put_all(world, expected)
    for member in (world.router, *world.members):
        assert member.heard == expected[member.identity], member.identity
    assert sum(map(len, expected.values())) >= 10


def test_without_rules_the_same_attempts_all_pass(folder: Path, deployment: Deployment) -> None:
    """The matrix has teeth: what it tries does reach the router."""
    with ExitStack() as stack:
        world = World(Plane.RADIO, folder, deployment, True, stack)
        world.subscribe_everywhere()
        put_all(world, world.expected(is_open=True))

        def answer(query: zenoh.Query) -> None:
            query.reply("foosim/q", "answer")

        world.router.kept.append(world.router.session.declare_queryable("foosim/q", answer))
        for member in world.members:

            def answered(its: Member = member) -> bool:
                return any(reply.ok is not None for reply in its.session.get("foosim/q"))

            wait_for("an answer", answered)


def test_nobody_is_present_as_another_and_all_see_the_router_only(world: World) -> None:
    router = world.router
    router.watch("foosim/**")
    for member in world.members:
        for key in (*presences(world.plane), "foosim/**"):
            member.watch(key)
    for member in world.members:  # with sessions of their own: one hears its own tokens, whatever the rules
        double = world.join(member.identity)
        mine = {key for key in presences(world.plane) if may_be_present(member.identity, key)}
        for key in sorted(presences(world.plane), key=mine.__contains__):
            double.kept.append(double.session.liveliness().declare_token(key))
    own = ALIVE[world.plane].replace("{name}", PRESENT.get(world.plane, router.identity))
    router.kept.append(router.session.liveliness().declare_token(own))
    granted = {key for key in presences(world.plane) for its in world.insiders if may_be_present(its.identity, key)}
    wait_for("the tokens", lambda: {key for _, key, _ in router.heard} == granted | {own})
    wait_for("the router's", lambda: all(("alive", own, "") in its.heard for its in world.insiders))
    for member in world.members:
        seen = {key for _, key, _ in member.heard}
        assert seen == ({own} if world.is_inside(member.identity) else set()), member.identity
        assert all(may_watch(member.identity, key) for key in seen)


def test_queries_are_answered_to_nobody(world: World) -> None:
    asked: list[str] = []

    def answer(query: zenoh.Query) -> None:
        asked.append(str(query.key_expr))
        query.reply(query.key_expr, "answer")

    world.router.kept.append(world.router.session.declare_queryable("**", answer))
    for member in world.members:
        member.kept.append(member.session.declare_queryable("foosim/**", answer))
    for member in world.members:
        for key in ("foosim/**", "@/**", keys(world.plane)[0]):
            replies = member.session.get(key, timeout=0.5, allowed_destination=zenoh.Locality.REMOTE)
            assert not [reply for reply in replies if reply.ok is not None], (member.identity, key)
    assert not asked


def test_a_put_with_wildcards_reaches_no_handler(world: World, folder: Path) -> None:
    """Zenoh may let it pass inside the sender's own keys: the receiver's session refuses it."""
    for member in world.members:
        for key in ("foosim/**", *(f"{key.rpartition('/')[0]}/*" for key in keys(world.plane))):
            with suppress(zenoh.ZError):
                member.session.put(key, b"x", attachment=member.identity)
    world.router.subscribe("foosim/**")

    def tried() -> bool:
        for member in world.insiders:
            member.put_everywhere(world.plane)
        return len({writer for _, _, writer in world.router.heard}) == len(world.insiders)

    wait_for("what is granted", tried)
    assert all(may_put(writer, key) and "*" not in key for _, key, writer in world.router.heard), (
        "no wildcard lies inside what one identity may put"
    )


@pytest.mark.parametrize("is_secured", [False, True], ids=["tcp", "tls"])
def test_a_link_of_long_delay_connects(folder: Path, deployment: Deployment, is_secured: bool) -> None:
    """Its session needs longer than the first attempts take."""
    server, node = (load_credentials(folder, name) if is_secured else None for name in ("supervisor", "node.red"))
    admits = None if server is None else Security(server, access_to(Plane.SIMULATION, deployment))
    late = Weather(delay_s=0.3)
    with Session.router("127.0.0.1:0", security=admits) as router:
        protocol, _, port = router.locator.partition("/127.0.0.1:")
        with Proxy(int(port), up=late, down=late) as proxy:
            address = proxy.address.replace("tcp", protocol)
            Session.client(address, LONG_S, security=None if node is None else Security(node)).close()
            assert proxy.accepted > 1, "also the first attempt has reached it"


def test_who_has_no_certificate_of_this_root_is_told_so(
    folder: Path, deployment: Deployment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    certificates.init(other)
    certificates.issue(other, ["node.red"])
    shutil.copytree(folder, tmp_path / "late", ignore=shutil.ignore_patterns("node.red.*"))
    credentials, theirs = load_credentials(folder, "supervisor"), load_credentials(other, "node.red")
    ours = load_credentials(folder, "node.red")
    assert credentials is not None and theirs is not None and ours is not None
    access = access_to(Plane.SIMULATION, deployment)
    with Session.router("127.0.0.1", security=Security(credentials, access)) as router:
        with pytest.raises(NotAuthorised, match="its certificate is not accepted here"):
            Session.client(router.locator, LONG_S, security=Security(theirs))
        trusting = replace(theirs, ca=ours.ca)
        with pytest.raises(NotAuthorised, match=r"it does not accept .*node.red.pem \("):
            Session.client(router.locator, LONG_S, security=Security(trusting))
        monkeypatch.setattr(certificates, "SLACK", timedelta(days=2))
        certificates.issue(tmp_path / "late", ["node.red"], days=1)
        late = replace(ours, certificate=tmp_path / "late" / "node.red.pem", key=tmp_path / "late" / "node.red.key")
        with pytest.raises(NotAuthorised, match=r"it does not accept .*node.red.pem \(certificate expired\)"):
            Session.client(router.locator, LONG_S, security=Security(late))
        nameless = ssl.create_default_context(cafile=str(ours.ca))
        with pytest.raises(ssl.SSLError, match="CERTIFICATE_REQUIRED"):
            shake(router.locator, nameless)
        with pytest.raises(NotAuthorised, match="requires a certificate"):
            Session.client(router.locator.replace("tls/", "tcp/"), LONG_S)
        Session.client(router.locator, LONG_S, security=Security(ours)).close()


def shake(locator: str, context: ssl.SSLContext) -> None:
    """Perform a TLS handshake with a router, and read its alert if it has one."""
    host, _, port = locator.partition("/")[2].rpartition(":")
    with (
        socket.create_connection((host, int(port)), LONG_S) as link,
        context.wrap_socket(link, server_hostname=host) as secured,
    ):
        secured.recv(1)


def test_a_plain_router_is_not_taken_for_a_safe_one(folder: Path) -> None:
    ours = load_credentials(folder, "node.red")
    assert ours is not None
    with Session.router("127.0.0.1") as router, pytest.raises((ConnectError, NotAuthorised)):
        Session.client(router.locator.replace("tcp/", "tls/"), 1.0, security=Security(ours))
