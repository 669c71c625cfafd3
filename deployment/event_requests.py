"""Events of the network that are requested during a run: from plain data to the text in an order.

A requested event is a deployment's event without its time: it happens at the tick of its answer. Its problems are
reported like those of a file, by path, value and nearest valid name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Final

from pydantic import ValidationError

from foosim.common import limits, units
from foosim.common.errors import Refused, describe
from foosim.common.finding import Finding, Location, with_written
from foosim.common.json_text import encode_json
from foosim.deployment.checks import Names
from foosim.deployment.network.impairments import Trace
from foosim.deployment.network.rules import Event, Network
from foosim.deployment.network.traces import file_settings
from foosim.deployment.network_checks import event_findings
from foosim.deployment.radio_checks import set_findings
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import schema_findings

PROBLEMS_MAX: Final = 20
_UNDER: Final[Location] = ("network", "events", 0)


class BadEvent(Refused):
    """An event with problems, one a line: `path: what, value, nearest name`."""

    exit_code = 2


def event_text(deployment: Deployment, data: object, at_ns: int) -> str:
    """Return an event as JSON, without spaces; `at_ns` is the simulated time at which it would happen.

    Raises BadEvent with all its problems, including references to the deployment.
    """
    if not isinstance(data, dict):
        raise BadEvent(describe("not an event, which is a mapping", data))
    findings = [with_written(finding, data) for finding in islice(_findings(deployment, data, at_ns), PROBLEMS_MAX)]
    if findings:
        raise BadEvent("\n".join(dict.fromkeys(finding.text for finding in findings)))
    text = encode_json(data).decode()
    if len(text.encode()) > limits.EVENT_BYTES_MAX:
        raise BadEvent(f"an event of {len(text.encode())} bytes, at most {limits.EVENT_BYTES_MAX} are allowed")
    return text


def _findings(deployment: Deployment, data: dict[str, object], at_ns: int) -> list[Finding]:
    if "at" in data:
        return [Finding(("at",), "an event that is asked for happens at the next tick, it has no time", "at", at="key")]
    links = [rule.id for rule in deployment.network.links]
    try:
        event = Event.model_validate({**data, "at": f"{at_ns} ns"})
    except ValidationError as error:
        of_schema = schema_findings(error, _UNDER)
        return [replace(finding, location=finding.location[len(_UNDER) :]) for finding in of_schema]
    found = list(event_findings(Names(deployment.endpoints()), (), event, links))
    found += set_findings(deployment.profiles(), event, (), deployment.endpoints())
    found += _files(deployment, event)
    if event.until_ns is not None and event.until_ns <= at_ns:
        what = f"not after the present simulated time, {units.format_ns(at_ns)}"
        found.append(Finding(("until",), what))
    return found


def _files(deployment: Deployment, event: Event) -> Iterator[Finding]:
    """A request cannot bring files: it may name those of the network, for the same use."""
    known = {(type(setting), setting.file) for _, setting in file_settings(deployment.network)}
    for _, setting in file_settings(Network(events=[event])):
        if (type(setting), setting.file) not in known or setting.digest is not None:
            key = "trace" if isinstance(setting, Trace) else "jitter"
            what = "not one of the files of its kind that this deployment's network names, or with a digest"
            yield Finding(("set", key, "file"), what, setting.file)
