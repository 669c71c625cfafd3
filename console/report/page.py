"""A report as one self-contained HTML page: it fetches nothing, and its tables need no script.

The script that draws is that of the console's page, in the page with the data that it reads. Every text is escaped,
also those that the capture's own makers chose.
"""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from html import escape
from typing import Any, Final

from foosim.common.json_text import encode_json
from foosim.console.report.charts import drawings, has_map
from foosim.console.report.collect import ChannelReport, LinkReport, Report
from foosim.console.server.page_files import page_files

ENDPOINTS_MAX: Final = 60
LINKS_SHOWN: Final = 100
ROWS_SHOWN: Final = 200


def page(found: Report) -> str:
    """Return the page."""
    title = escape(f"{found.name}: the network of {found.metadata.get('world', 'a run')}")
    names = _busiest(found)
    sections = (
        *(_head(found), _network(found), _events(found), _links(found, names), _over_time(found), _causes(found)),
        *(_ages(found), _uses(found), _senders(found), _configured(found), _places(found)),
    )
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
            *(part for section in sections for part in section),
            f'<script type="application/json" id="report-data">{_inlined(drawings(found, names))}</script>',
            f"<script>{script}</script>",
            "</body></html>",
            "",
        ]
    )


def _digest(content: str) -> str:
    """Return how a Content-Security-Policy names what stands in the page itself."""
    return f"sha256-{b64encode(sha256(content.encode()).digest()).decode()}"


def _inlined(content: Mapping[str, Any]) -> str:
    """Return JSON that ends no element of HTML, and begins none, whatever the texts in it are."""
    text = encode_json(content).decode()
    return text.replace("<", r"\u003c").replace(">", r"\u003e").replace("&", r"\u0026")


def _drawing(name: str, label: str) -> str:
    return f'<figure data-drawing="{name}" aria-label="{escape(label)}"></figure>'


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


# --- sections ---------------------------------------------------------------------------------------------------------


def _head(found: Report) -> Iterator[str]:
    span = f"{_seconds(found.start_ns)} to {_seconds(found.end_ns)}, {found.ticks} ticks of {found.tick_ns / 1e6:g} ms"
    rows = [
        ("simulated", span if found.finished else f"{span}; the capture is not finished"),
        *sorted(found.metadata.items()),
        ("digest of the last frame", found.digest),
        ("digest of all ticks", found.chain),
    ]
    yield "<table>"
    for name, value in rows:
        yield f"<tr><td>{escape(name)}</td><td><code>{escape(value)}</code></td></tr>"
    yield "</table><h2>Packets</h2>"
    offered = found.fates["offered"]
    fates = [(fate.replace("_", " "), count, _percent(count / offered) if offered else "-")
             for fate, count in found.fates.items()]  # fmt: skip
    yield '<div class="two"><div>' + _table(("fate", "packets", "share"), fates)
    if found.copies:
        yield _note(f"{found.copies} of them are copies that links made.")
    causes = sorted(found.causes.items(), key=lambda entry: (-entry[1], entry[0]))
    shares = [(cause, count, _percent(count / offered)) for cause, count in causes]
    yield "</div><div>" + (_table(("dropped by", "packets", "share"), shares) if shares else _note("Nothing was lost."))
    yield "</div></div>"


def _network(found: Report) -> Iterator[str]:
    yield "<h2>Network</h2>"
    if found.radios:
        radios = [(radio.name, radio.preset, radio.settings, radio.carriers) for radio in found.radios]
        yield _table(("radio", "preset", "settings that are no defaults", "carried by"), radios, 3)
    if found.rules:
        yield _table(("rule", "for", "settings"), [(rule.name, rule.ends, rule.settings) for rule in found.rules], 3)
    yield _note(f"Where nothing else is written: {found.defaults}.")


def _events(found: Report) -> Iterator[str]:
    yield "<h2>Events</h2>"
    if not (found.happenings or found.bands or found.marks):
        yield _note("Nothing happened to the network, nobody changed the world, and no process was lost.")
        return
    yield _drawing("events", "events over time")
    if found.bands_left:
        yield _note(f"The first {len(found.bands)} times are drawn, {found.bands_left} more are not.")
    happened = [
        (event.at_ns, event.text, "rules" if event.kind else "asked for" if event.is_asked else "deployment")
        for event in found.happenings
    ]
    happened += [(mark.at_ns, mark.text, "recovery") for mark in found.marks]
    happened.sort()
    rows = [(_seconds(at_ns), text, by) for at_ns, text, by in happened[:ROWS_SHOWN]]
    yield _table(("at", "what", "by"), rows, 3)
    if len(happened) > ROWS_SHOWN:
        yield _note(f"And {len(happened) - ROWS_SHOWN} more.")


def _busiest(found: Report) -> list[str]:
    """Return the endpoints of most packets, by name."""
    packets: Counter[str] = Counter()
    for link in found.links:
        packets[link.source] += link.offered
        packets[link.destination] += link.offered
    return sorted(name for name, _ in packets.most_common(ENDPOINTS_MAX))


def _links(found: Report, names: Sequence[str]) -> Iterator[str]:
    yield "<h2>Links</h2>"
    if not names:
        yield _note("No packets.")
        return
    yield _note("From each row to each column, coloured by the share lost of what has a fate.")
    endpoints = {end for link in found.links for end in (link.source, link.destination)}
    if len(endpoints) > len(names):
        yield _note(f"The {len(names)} busiest of {len(endpoints)} endpoints.")
    yield _drawing("links", "share lost per link")


def _over_time(found: Report) -> Iterator[str]:
    yield "<h2>Delay and loss over time</h2>"
    if not found.channels:
        yield _note("No packets.")
        return
    yield _note(
        f"By channel, in spans of {_seconds(found.bin_ns)} by the time of sending; the busiest channels. Partitions "
        "and clogs are shades, losses and returns of processes dashed lines."
    )
    yield '<div class="two">'
    for number, channel in enumerate(found.channels):
        yield f"<div>{_channel(number, channel)}</div>"
    yield "</div>"


def _channel(number: int, channel: ChannelReport) -> str:
    judged = channel.delivered + channel.dropped
    share = f", {_percent(channel.dropped / judged)} lost" if judged else ""
    return "\n".join(
        [
            f"<h3>{escape(channel.name)}: {channel.packets} packets{share}</h3>",
            _drawing(f"delay-{number}", f"delay of {channel.name}"),
            _drawing(f"loss-{number}", f"loss of {channel.name}"),
        ]
    )


def _causes(found: Report) -> Iterator[str]:
    yield "<h2>Causes of losses over time</h2>"
    yield _drawing("causes", "packets lost by cause over time") if found.causes else _note("Nothing was lost.")


def _ages(found: Report) -> Iterator[str]:
    yield "<h2>Age of information</h2>"
    yield _note(
        "How old, at the receiver, the newest is that has come on a link: mean and greatest, from the first arrival to "
        "the end. Links on which nothing came stand first, then the oldest."
    )
    shown = sorted(found.links, key=_staleness)[:LINKS_SHOWN]
    yield _table(
        ("from", "to", "offered", "delivered", "mean delay ms", "longest", "mean age ms", "greatest"),
        [
            (link.source, link.destination, link.offered, link.delivered,
             *(f"{ms:.3f}" if link.delivered else "-" for ms in (link.delay_mean_ms, link.delay_most_ms)),
             *("never" if ms is None else f"{ms:.1f}" for ms in (link.age_mean_ms, link.age_most_ms)))
            for link in shown
        ],
        2,
    )  # fmt: skip
    if len(found.links) > len(shown):
        yield _note(f"And {len(found.links) - len(shown)} links with newer information.")


def _uses(found: Report) -> Iterator[str]:
    yield "<h2>Age at use</h2>"
    if not found.uses:
        yield _note("The capture does not tell it: nobody who hears a channel has acted.")
        return
    yield _note(
        "What a controller feels: how old the newest packet of a channel was each time that its receiver acted. It is "
        "the link's delay, and the time that the packet waited for the receiver's turn. The oldest stand first."
    )
    shown = sorted(found.uses, key=lambda use: -use.age.p99_ms)[:LINKS_SHOWN]
    yield _table(
        ("from", "to", "channel", "uses", "mean delay ms", "median age ms", "99 %", "greatest"),
        [
            (use.source, use.destination, use.channel, use.age.uses, f"{use.delay_mean_ms:.3f}",
             *(f"{ms:.1f}" for ms in (use.age.p50_ms, use.age.p99_ms, use.age.most_ms)))
            for use in shown
        ],
        3,
    )  # fmt: skip
    if len(found.uses) > len(shown):
        yield _note(f"And {len(found.uses) - len(shown)} channels that are newer.")


def _staleness(link: LinkReport) -> tuple[bool, float, str, str]:
    return link.age_most_ms is not None, -(link.age_most_ms or 0.0), link.source, link.destination


def _senders(found: Report) -> Iterator[str]:
    yield "<h2>Queues and airtime</h2>"
    if not found.senders:
        yield _note("Nothing waited, and nothing took time to send.")
        return
    yield _note(
        "Each radio of an endpoint, and each queue of a wire; a broadcast counts once. Airtime is the share of the run "
        "that the last attempts took; earlier attempts are in the time of access."
    )
    shown = sorted(found.senders, key=lambda sender: (-sender.airtime_share, sender.source, sender.medium))[:ROWS_SHOWN]
    head = ("from", "by", "packets", "queue mean ms", "p95", "longest", "access mean ms", "longest", "retries")
    yield _table(
        (*head, "airtime"),
        [
            (s.source, s.medium, s.transmissions, f"{s.queue_mean_ms:.3f}", f"{s.queue_p95_ms:.3f}",
             f"{s.queue_most_ms:.3f}", f"{s.access_mean_ms:.3f}", f"{s.access_most_ms:.3f}", s.retries,
             _percent(s.airtime_share))
            for s in shown
        ],
        2,
    )  # fmt: skip
    if len(found.senders) > len(shown):
        yield _note(f"And {len(found.senders) - len(shown)} that took less.")


def _configured(found: Report) -> Iterator[str]:
    yield "<h2>Configured and measured</h2>"
    yield _note(
        "By rule and radio. A link's own loss is what is lost singly or in bursts, of what came so far; its own delay "
        "is what it adds by itself. Waiting, the medium, the way, clogs, partitions and receivers do the rest. "
        "Configured is what the deployment says: * where events changed it meanwhile."
    )
    head = ("rule", "radio", "links", "packets", "own loss configured", "measured", "own delay configured ms")
    yield _table(
        (*head, "measured", "all loss", "mean delay ms", "median", "p95"),
        [
            (m.rule + ("*" if m.is_changed else ""), m.radio or "-", m.links, m.packets,
             _percent(m.own_loss_configured), _percent(m.own_loss),
             f"{m.own_delay_configured_ms:.3f}", f"{m.own_delay_ms:.3f}", _percent(m.loss),
             f"{m.delay_mean_ms:.3f}", f"{m.delay_p50_ms:.3f}", f"{m.delay_p95_ms:.3f}")
            for m in found.measured
        ],
        2,
    )  # fmt: skip


def _places(found: Report) -> Iterator[str]:
    where = found.map
    if not has_map(where):
        return
    yield "<h2>Map</h2>"
    yield _note(
        "From above: what stands, the ways of bodies with their last places, and where packets were lost: in the "
        "middle between their ends, as of the captured frame before. A way is cut where a body was put elsewhere. "
        "What is beyond the field stands at its edge."
    )
    yield _drawing("map", "the world from above")
    drawn = where.lost - where.placeless
    if drawn > len(where.losses):
        yield _note(f"A sample of {len(where.losses)} of {drawn} lost packets.")
    if where.placeless:
        yield _note(f"{where.placeless} lost packets have ends without a place and are not drawn.")
    if where.links:
        yield "<h3>Most lost</h3>"
        yield _table(("from", "to", "by", "packets"), where.links, 3)
