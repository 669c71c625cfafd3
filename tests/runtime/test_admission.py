"""Who hears nothing of its router is told that it is not authorised; an open plane is said every minute."""

from pathlib import Path

import pytest

from foosim.common.addresses import parse_address
from foosim.runtime.transport.admission import ADMISSION_NS, REMINDER_NS, Admission, Exposure
from foosim.runtime.transport.certificates import Credentials, NotAuthorised

WHO = Credentials("node.green", Path("ca.pem"), Path("node.green.pem"), Path("node.green.key"))


def test_silence_is_a_refusal_only_for_who_shows_a_certificate() -> None:
    admission = Admission(WHO, "supervisor", "tls/10.0.0.1:7400", 5)
    admission.check(4 + ADMISSION_NS)
    admission.heard("supervisor", False)
    admission.heard("blue", True)
    with pytest.raises(NotAuthorised, match=r"^node\.green: not authorised, or not reachable: .* tls/10\.0\.0\.1:7400"):
        admission.check(5 + ADMISSION_NS)
    Admission(None, "supervisor", "tcp/10.0.0.1:7400", 5).check(10 * ADMISSION_NS)


def test_who_has_heard_the_router_is_in_for_good() -> None:
    admission = Admission(WHO, "supervisor", "tls/10.0.0.1:7400", 0)
    admission.heard("supervisor", True)
    admission.heard("supervisor", False)
    admission.check(10 * ADMISSION_NS)


def test_an_open_plane_is_said_at_once_and_every_minute() -> None:
    exposure = Exposure(parse_address("0.0.0.0:7400"), 7)
    said = [now_ns for now_ns in range(7, 7 + 3 * REMINDER_NS, REMINDER_NS // 10) if exposure.due(now_ns)]
    assert said == [7, 7 + REMINDER_NS, 7 + 2 * REMINDER_NS]
    assert "any process that reaches tcp/192.168.0.1:5 can take part" in Exposure(
        parse_address("192.168.0.1:5"), 0
    ).due(0)


@pytest.mark.parametrize("address", ["tcp/127.0.0.1:7400", "tcp/[::1]:7400", "tls/0.0.0.0:7400", "tls/10.0.0.1:1"])
def test_a_plane_that_is_not_open_says_nothing(address: str) -> None:
    assert Exposure(parse_address(address), 0).due(10 * REMINDER_NS) == ""
