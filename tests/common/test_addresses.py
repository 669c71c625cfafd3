"""Addresses on which planes listen: how they are written, who reaches them, and that this is asked for."""

import pytest

from foosim.common.addresses import Address, Insecure, check_listen, parse_address, reachable
from foosim.common.errors import BadValue


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1", Address("127.0.0.1", 0)),
        ("127.0.0.1:7447", Address("127.0.0.1", 7447)),
        ("tcp/127.0.0.1:0", Address("127.0.0.1", 0)),
        ("tcp/lab-3.example.org:65535", Address("lab-3.example.org", 65535)),
        ("[::1]:7447", Address("[::1]", 7447)),
        ("[::]", Address("[::]", 0)),
    ],
)
def test_an_address_reads_back_as_it_is_shown(text: str, address: Address) -> None:
    assert parse_address(text) == address
    assert parse_address(str(address)) == address


@pytest.mark.parametrize(
    "text", ["", ":7447", "udp/127.0.0.1:1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", "::1", "a b", "a\n"]
)
def test_what_is_none_is_refused(text: str) -> None:
    with pytest.raises(BadValue, match="not an address"):
        parse_address(text)


@pytest.mark.parametrize(("text", "written"), [("::1", "[::1]"), ("tcp/::1", "tcp/[::1]"), ("fe80::0:1", "[fe80::1]")])
def test_a_bare_address_of_ipv6_is_shown_as_it_is_written(text: str, written: str) -> None:
    with pytest.raises(BadValue, match="not an address") as refused:
        parse_address(text)
    assert refused.value.nearest == repr(written)
    assert parse_address(written).host == written.removeprefix("tcp/")


@pytest.mark.parametrize("text", ["127.0.0.1", "127.8.9.1:5", "localhost:5", "[::1]:7"])
def test_this_machine_alone_reaches_a_loopback_address(text: str) -> None:
    assert check_listen(text, insecure=False) == parse_address(text)


@pytest.mark.parametrize("text", ["0.0.0.0", "[::]:5", "192.168.1.4:5", "lab-3.example.org", "localhost.example.org"])
def test_what_others_reach_has_to_be_meant(text: str) -> None:
    with pytest.raises(Insecure, match="or --insecure to allow it"):
        check_listen(text, insecure=False)
    assert check_listen(text, insecure=True) == parse_address(text)


def test_the_radio_plane_is_one_port_higher_and_needs_room() -> None:
    assert str(check_listen("127.0.0.1:7447", insecure=False, ports=2).next_port()) == "tcp/127.0.0.1:7448"
    assert parse_address("127.0.0.1").next_port().port == 0, "the system chooses both"
    assert check_listen("127.0.0.1:65534", insecure=False, ports=2).port == 65534
    with pytest.raises(BadValue, match="no room for 2 ports"):
        check_listen("127.0.0.1:65535", insecure=False, ports=2)


def test_of_a_wildcards_addresses_others_are_told_one_that_they_reach() -> None:
    everywhere = parse_address("0.0.0.0:7447")
    locators = ["tcp/127.0.0.1:7447", "tcp/[fe80::1%eth0]:7447", "tcp/[2001:db8::4]:7447", "tcp/192.168.1.4:7447"]
    assert reachable(locators, everywhere) == "tcp/192.168.1.4:7447"
    assert reachable(locators[:3], everywhere) == "tcp/[2001:db8::4]:7447"
    assert reachable(locators[:1], everywhere) == "tcp/127.0.0.1:7447"
    assert reachable(locators, parse_address("127.0.0.1")) == "tcp/127.0.0.1:7447"
