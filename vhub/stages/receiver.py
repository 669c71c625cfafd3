"""Receiver: drops packets at arrival if the receiver is down, has left, or is over its limit."""

from __future__ import annotations

from typing import Final

from foosim.capture.rows import ClientRow
from foosim.vhub.network.packet import Flight, size_of_payload
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.stage import Stage

RECEIVER_DOWN: Final = "rx_down"
RECEIVER_FULL: Final = "rx_full"
"""The packets of a receiver at one tick are one message: packets beyond its size are dropped."""
TRANSIT_FULL: Final = "transit_full"
"""Found at sending: there is a limit of bytes in flight in the whole run."""


class Receiver(Stage):
    """Drops packets for the reasons that the state finds at arrival: body out of service, client left, message full."""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        return hindered

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, decided = seen.row, seen.row.decided_by
        if row.cause == TRANSIT_FULL:
            note.add("the packets in flight in the whole run leave no room for it", due_ns=row.due_ns)
            return
        note.add("due {due_ns}, arrives at tick {arrival_tick}", due_ns=row.due_ns, arrival_tick=row.arrival_tick)
        if row.cause == RECEIVER_DOWN:
            note.add(", {} {receiver}", row.destination, receiver=_state(seen))
        elif row.cause == RECEIVER_FULL:
            note.add(", {message_bytes} B in a message", message_bytes=size_of_payload(row.size))
            left, share = decided.room_left, decided.room_share
            note.add(
                " in which {} has {room_left} B left of {room_share} B", row.source, room_left=left, room_share=share
            )
        note.facts["wall_released_ns"] = row.wall_released_ns
        if row.wall_released_ns:
            note.text += f", left for it at {row.wall_released_ns} ns of the vHub's clock"


def _state(seen: Seen) -> str:
    """Return why a receiver did not take anything: a client that has left, or never came, or a body."""
    to, evidence = seen.row.destination, seen.evidence
    is_here = to in evidence.deployment.robots
    for client in evidence.clients():
        if isinstance(client, ClientRow) and client.client == to and client.tick <= seen.row.arrival_tick:
            is_here = client.event == "joins"
    return f"is {seen.out_of_service(to)}" if is_here else "is not here"
