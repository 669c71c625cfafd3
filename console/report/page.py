"""A report as one self-contained HTML page: it loads nothing, and its tables need no script.

The script that draws charts and map is that of the console's page; it is in the page, with its data. All texts are
escaped, also those of the capture's makers.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from html import escape
from typing import Any, Final

from foosim.common.json_text import encode_json
from foosim.console.report.collect import Report
from foosim.console.server.page_files import page_files

LINKS_SHOWN: Final = 100
ROWS_SHOWN: Final = 200


def page(found: Report) -> str:
    """Return the page of a report."""
    title = escape(f"{found['name']}: the network of {found['metadata'].get('world', 'a run')}")
    files = page_files()
    script, style = files["/report.js"].content.decode(), files["/report.css"].content.decode()
    policy = f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'"
    return "\n".join(
        [
            "<!DOCTYPE html>",
            f'<html lang="en" data-theme="auto"><head><meta charset="utf-8"><title>{title}</title>',
            f"<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}; base-uri 'none'; form-action 'none'\">",
            '<meta name="viewport" content="width=device-width">',
            f"<style>{style}</style></head><body>",
            f"<h1>{title}</h1>",
            '<noscript><p class="note">Charts and map need JavaScript. The tables do not.</p></noscript>',
            *_sections(found),
            f'<script type="application/json" id="report-data">{_inlined(found)}</script>',
            f"<script>{script}</script>",
            "</body></html>",
            "",
        ]
    )


def _digest(content: str) -> str:
    """Return the name of inlined text in a Content-Security-Policy."""
    return f"sha256-{b64encode(sha256(content.encode()).digest()).decode()}"


def _inlined(content: Mapping[str, Any]) -> str:
    """Return JSON that neither ends nor begins an element of HTML, for any texts in it."""
    text = encode_json(content).decode()
    return text.replace("<", r"\u003c").replace(">", r"\u003e").replace("&", r"\u0026")


# --- sections ---------------------------------------------------------------------------------------------------------


def _sections(found: Report) -> Iterator[str]:
    yield from _head(found)
    yield from _network(found)
    yield from _events(found)
    yield from _over_time(found)
    yield from _tables(found)
    if found["scene"] is not None:
        yield from _map(found["map"])


def _head(found: Report) -> Iterator[str]:
    start, end = (_seconds(found[at]) for at in ("start_ns", "end_ns"))
    span = f"{start} to {end}, {found['ticks']} ticks of {found['tick_ns'] / 1e6:g} ms"
    rows = [
        ("simulated", span if found["finished"] else f"{span}; the capture is not finished"),
        *sorted(found["metadata"].items()),
        ("digest of the last frame", found["digest"]),
        ("digest of all ticks", found["chain"]),
    ]
    lines = (f"<tr><td>{escape(name)}</td><td><code>{escape(value)}</code></td></tr>" for name, value in rows)
    yield f"<table>{''.join(lines)}</table><h2>Packets</h2>"
    offered = max(1, found["fates"]["offered"])
    causes = sorted(found["causes"].items(), key=lambda entry: (-entry[1], entry[0]))
    fates = [(fate.replace("_", " "), count) for fate, count in found["fates"].items()]
    yield '<div class="two">'
    for what, counts in (("fate", fates), ("dropped by", causes)):
        rows = [(name, count, _percent(count / offered)) for name, count in counts]
        yield f"<div>{_table((what, 'packets', 'share'), rows) if rows else _note('No packet was lost.')}</div>"
    yield "</div>"
    if found["copies"]:
        yield _note(f"{found['copies']} of them are copies that links made.")


def _network(found: Report) -> Iterator[str]:
    yield "<h2>Network</h2>"
    if found["radios"]:
        head = ("radio", "preset", "settings other than the preset's", "carried by")
        yield _table(head, _columns(found["radios"], "name", "preset", "settings", "carriers"), 3)
    if found["rules"]:
        yield _table(("rule", "for", "settings"), _columns(found["rules"], "name", "ends", "settings"), 3)
    yield _note(f"Defaults: {found['defaults']}.")


def _events(found: Report) -> Iterator[str]:
    yield "<h2>Events</h2>"
    if not (found["events"] or found["bands"]):
        yield _note("No event, no request, no lost process.")
        return
    yield _drawing("events", "events over time")
    if found["bands_left"]:
        yield _note(f"The first {len(found['bands'])} spans are drawn, {found['bands_left']} more are not.")
    rows = [(_seconds(event["at_ns"]), event["text"], event["by"]) for event in found["events"]]
    yield _first(("at", "what", "by"), rows, ROWS_SHOWN, 3)


def _over_time(found: Report) -> Iterator[str]:
    yield "<h2>Links</h2>"
    if not found["links"]:
        yield _note("No packets.")
        return
    yield _note("From each row to each column, coloured by the lost share of packets with a fate.")
    endpoints = {end for link in found["links"] for end in (link["source"], link["destination"])}
    if len(endpoints) > len(found["endpoints"]):
        yield _note(f"The {len(found['endpoints'])} busiest of {len(endpoints)} endpoints.")
    yield _drawing("links", "share lost per link")
    yield "<h2>Delay and loss over time</h2>"
    yield _note(
        f"By channel, in spans of {_seconds(found['bin_ns'])} by the time of sending; the busiest channels. Partitions "
        "and clogs are shades, losses and returns of processes dashed lines."
    )
    yield '<div class="two">'
    for number, channel in enumerate(found["channels"]):
        name, loss = channel["name"], channel["loss"]
        share = "" if loss is None else f", {_percent(loss)} lost"
        yield f"<div><h3>{escape(name)}: {channel['packets']} packets{share}</h3>"
        yield _drawing(f"delay-{number}", f"delay of {name}") + _drawing(f"loss-{number}", f"loss of {name}")
        yield "</div>"
    yield "</div>"
    if found["causes"]:
        yield "<h2>Causes of losses over time</h2>"
        yield _drawing("causes", "packets lost by cause over time")


def _tables(found: Report) -> Iterator[str]:
    yield "<h2>Age of information</h2>"
    yield _note(
        "The age, at the receiver, of the newest information that a link has delivered: mean and greatest, from the "
        "first arrival to the end. Links without an arrival are first, then the oldest."
    )
    links = sorted(found["links"], key=lambda link: (link["age_most_ms"] is not None, -(link["age_most_ms"] or 0.0)))
    head = ["from", "to", "offered", "delivered", "mean delay ms", "longest", "mean age ms", "greatest"]
    names = ["source", "destination", "offered", "delivered", "delay_mean_ms", "delay_most_ms"]
    rows = _columns(links, *names, "age_mean_ms", "age_most_ms", none="never")
    yield _first(head, rows, LINKS_SHOWN, 2)

    yield "<h2>Age at use</h2>"
    yield _note(
        "The age of a channel's newest packet each time that its receiver acted: the link's delay, and the time that "
        "the packet waited for the receiver's turn. The oldest are first."
    )
    uses = sorted(found["uses"], key=lambda use: -use["p99_ms"])
    head = ["from", "to", "channel", "uses", "mean delay ms", "median age ms", "99 %", "greatest"]
    names = ["source", "destination", "channel", "uses", "delay_mean_ms", "p50_ms", "p99_ms", "most_ms"]
    yield _first(head, _columns(uses, *names), LINKS_SHOWN, 3)

    yield "<h2>Queues and airtime</h2>"
    yield _note(
        "Each radio of an endpoint, and each queue of a wire; a broadcast counts once. Airtime is the share of the run "
        "that the last attempts took; earlier attempts are in the time of access."
    )
    senders = sorted(found["senders"], key=lambda sender: (-sender["airtime_share"], sender["source"]))
    head = ["from", "by", "packets", "queue mean ms", "p95", "longest", "access mean ms", "longest", "retries"]
    names = ["source", "medium", "transmissions", "queue_mean_ms", "queue_p95_ms", "queue_most_ms"]
    rows = _columns(senders, *names, "access_mean_ms", "access_most_ms", "retries", "airtime_share")
    yield _first([*head, "airtime"], rows, ROWS_SHOWN, 2)

    yield "<h2>Configured and measured</h2>"
    yield _note(
        "By rule and radio. A link's own loss is what it loses singly or in bursts of the packets that come so far, "
        "its own delay what it adds by itself. Queue, medium, propagation, clogs, partitions and receivers add the "
        "rest. Configured are the values of the deployment: * where events changed them."
    )
    measured = [{**one, "rule": one["rule"] + "*" * one["is_changed"]} for one in found["measured"]]
    head = ["rule", "radio", "links", "packets", "own loss configured", "measured", "own delay configured ms"]
    names = ["rule", "radio", "links", "packets", "own_loss_configured", "own_loss", "own_delay_configured_ms"]
    rows = _columns(measured, *names, "own_delay_ms", "loss", "delay_mean_ms", "p50_ms", "p95_ms")
    yield _table([*head, "measured", "all loss", "mean delay ms", "median", "p95"], rows, 2)


def _map(found: Report) -> Iterator[str]:
    yield "<h2>Map</h2>"
    yield _note(
        "From above: scenery, the paths of bodies with their last places, and the places of lost packets: the middle "
        "between their ends in the captured frame before. A path is cut where a body jumped. What is beyond the field "
        "is at its edge."
    )
    yield _drawing("map", "the world from above")
    drawn = found["lost"] - found["placeless"]
    if drawn > len(found["losses"]):
        yield _note(f"A sample of {len(found['losses'])} of {drawn} lost packets.")
    if found["placeless"]:
        yield _note(f"{found['placeless']} lost packets have ends without a place and are not drawn.")
    if found["links"]:
        yield "<h3>Most lost</h3>"
        yield _table(("from", "to", "by", "packets"), found["links"], 3)


# --- elements ---------------------------------------------------------------------------------------------------------


def _drawing(name: str, label: str) -> str:
    return f'<figure data-drawing="{name}" aria-label="{escape(label)}"></figure>'


def _columns(items: Iterable[Report], *names: str, none: str = "-") -> list[tuple[str, ...]]:
    """Return some values of each item as texts: times in ms with three digits, shares and losses in percent."""
    return [tuple(_text(name, item[name], none) for name in names) for item in items]


def _text(name: str, value: Any, none: str) -> str:
    if value is None:
        return none
    if name.endswith("_ms"):
        return f"{value:.3f}"
    return _percent(value) if isinstance(value, float) else str(value)


def _first(head: Sequence[str], rows: Sequence[Sequence[object]], most: int, texts: int) -> str:
    """Return a table of the first rows, and a note of the number of the others."""
    if not rows:
        return _note("None.")
    more = _note(f"And {len(rows) - most} more.") if len(rows) > most else ""
    return _table(head, rows[:most], texts) + more


def _table(head: Sequence[str], rows: Iterable[Sequence[object]], texts: int = 1) -> str:
    """Return a table; the first `texts` columns are texts, the others numbers."""
    kinds = ["" if column < texts else ' class="n"' for column in range(len(head))]
    lines = ["".join(f"<th{kind}>{escape(name)}</th>" for kind, name in zip(kinds, head, strict=True))]
    for row in rows:
        lines.append("".join(f"<td{kind}>{escape(str(cell))}</td>" for kind, cell in zip(kinds, row, strict=True)))
    return f'<div class="rows"><table>{"".join(f"<tr>{line}</tr>" for line in lines)}</table></div>'


def _note(text: str) -> str:
    return f'<p class="note">{escape(text)}</p>'


def _percent(share: float) -> str:
    return f"{100.0 * share:.4g} %"


def _seconds(ns: int) -> str:
    return f"{ns / 1e9:.9g} s"
