"""The channel: whether a signal that was sent is strong enough at its receiver, and clear of the others'.

At sending it reports the medium's outcome of a unicast, and judges the rest by the draw for errors; at arrival
it judges again broadcasts and packets without repeats, which a later transmission may have spoiled.
"""

from __future__ import annotations

from foosim.common.keyed_random import UNIT, Slot
from foosim.vhub.network.air import DEAF
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.errors import (
    LORA_FACTORS,
    LORA_GATEWAY_SENSITIVITY_DBM,
    LORA_ISOLATION_DB,
    LORA_SENSITIVITY_DBM,
    lora_interferer,
    lora_received,
)
from foosim.vhub.radio.noise import level_of, units_of
from foosim.vhub.radio.propagation import BLOCKED, OUT_OF_RANGE
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.medium import COLLISION, SNR, error_curve
from foosim.vhub.stages.stage import Stage


class Channel(Stage):
    """Decides the signals of one link."""

    def __init__(self, setup: LinkSetup) -> None:
        assert setup.budget is not None
        self._budget, self._air = setup.budget, setup.air
        self._factor = setup.settings.spreading_factor if setup.settings.medium == "lora" else 0
        self._is_gateway = setup.settings.gateway
        self._curve = error_curve(setup.settings)

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Channel | None:
        return cls(setup) if setup.settings.is_on_air else None

    def at_sending(self, flight: Flight) -> str:
        if flight.outcome or flight.is_settled:
            return flight.outcome
        cause = self._judge(flight)
        if not cause and self._air is not None:
            self._air.listen(flight, self._budget.propagation)
            cause = self._judge(flight) if flight.interference else ""
        return cause

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        if self._air is not None:
            self._air.settle(flight.due_ns)
        return self._judge(flight) if flight.interference and not flight.is_settled else ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, settings = seen.row, seen.settings
        walls = self._walls(seen)
        note.add("{distance_m} m", distance_m=row.distance_mm / 1000.0, walls=walls, line_of_sight=not walls)
        note.facts["walls_db"] = walls_db = row.walls_cdb / 100.0
        each = ", ".join(name if loss_db is None else f"{name} {loss_db:g} dB" for name, loss_db in walls.items())
        note.text += f", through {each} ({walls_db:g} dB in all)" if walls else ", in line of sight"
        if row.cause in (OUT_OF_RANGE, BLOCKED) and not row.received_cdbm:
            range_m = settings.path_loss.range_m
            note.add(", nothing gets through", range_m=range_m)
            note.text += f" (range {range_m:g} m)" if range_m is not None and row.cause == OUT_OF_RANGE else ""
            return
        note.add(", path loss {path_loss_db} dB", path_loss_db=row.path_loss_cdb / 100.0)
        note.add(" (shadowing {shadowing_db}", shadowing_db=row.shadowing_cdb / 100.0)
        note.add(", fading {fading_db})" if settings.fading is not None else ")", fading_db=row.fading_cdb / 100.0)
        note.add(", {received_dbm} dBm", received_dbm=row.received_cdbm / 100.0, error_rate=row.error_ppm / 1e6)
        note.add(" over {noise_dbm} dBm of noise", noise_dbm=self._budget.propagation.noise_cdbm / 100.0)
        note.add(" is {snr_db} dB", snr_db=row.snr_cdb / 100.0)
        others_dbm, half_duplex = row.interference_cdbm / 100.0 or None, row.decided_by.collision == "half_duplex"
        note.facts |= {"interference_dbm": others_dbm, "half_duplex": half_duplex}
        if half_duplex:
            note.text += f"; {row.destination} is on air itself meanwhile and hears nothing (half duplex)"
        elif self._factor:
            self._explain_lora(seen, note)
        else:
            self._explain_errors(seen, note)

    def _explain_errors(self, seen: Seen, note: Explanation) -> None:
        row, settings, flight = seen.row, seen.settings, seen.flight
        if row.interference_cdbm:
            flight.received_cdbm, flight.interference = row.received_cdbm, units_of(row.interference_cdbm)
            note.text += f", others {row.interference_cdbm / 100.0:g} dBm"
            note.add(" make it {sinr_db} dB", sinr_db=self._budget.ratio_cdb(flight) / 100.0)
        if row.cause == OUT_OF_RANGE:
            note.add(", the receiver needs {sensitivity_dbm} dBm", sensitivity_dbm=settings.sensitivity_dbm)
        elif row.error_word:
            note.text += f", error rate {row.error_ppm / 1e6:g}"
            if not seen.is_broadcast and settings.medium in ("wifi", "ieee802154"):
                note.text += " an attempt"
            else:
                note.add(", draw {error_draw}", error_draw=int(row.error_word, 16) / UNIT)

    def _explain_lora(self, seen: Seen, note: Explanation) -> None:
        row, place = seen.row, self._factor - LORA_FACTORS[0]
        floors = LORA_GATEWAY_SENSITIVITY_DBM if self._is_gateway else LORA_SENSITIVITY_DBM
        floor_dbm = max(floors[place], seen.settings.sensitivity_dbm)
        note.add(", the receiver needs {sensitivity_dbm} dBm", sensitivity_dbm=floor_dbm)
        others = note.facts["others"] = {}
        levels = zip(LORA_FACTORS, row.decided_by.by_factor_cdbm, LORA_ISOLATION_DB[place], strict=False)
        for factor, level, needed_db in levels:
            if level:
                dbm, ratio_db = level / 100.0, round(row.received_cdbm / 100.0 - level / 100.0, 2)
                others[factor] = {"dbm": dbm, "ratio_db": ratio_db, "needed_db": float(needed_db)}
                note.text += f", others at SF{factor} {dbm:g} dBm: {ratio_db:g} dB over them of {needed_db} dB needed"

    def _walls(self, seen: Seen) -> dict[str, float | None]:
        """Return the obstacles on the way, with the loss of each in dB; None where they are not known any more.

        Bodies move: the newest captured frame before the packet counts, if its losses add up to the row's.
        """
        row, of = seen.row, self._budget.propagation
        frame = seen.evidence.frame(seen.tick) if row.walls else None
        if frame is None:
            return dict.fromkeys(row.walls)
        world = of.world
        world.turn_to(frame)
        ends = frozenset((world.body(row.source), world.body(row.destination)))
        a, b = sorted((of.place(row.source).at, of.place(row.destination).at))
        known = [(crossing.name, of.taken_db(crossing, a, b, ends)) for crossing in world.crossings(a, b, ends)]
        total_cdb = round(sum(loss_db for _, loss_db in known) * 100.0)
        agrees = sorted(name for name, _ in known) == sorted(row.walls) and abs(total_cdb - row.walls_cdb) <= 1
        return {name: round(loss_db, 2) for name, loss_db in known} if agrees else dict.fromkeys(row.walls)

    def _judge(self, flight: Flight) -> str:
        """Return why the signal is lost, given the transmissions so far; empty when it is received."""
        if flight.interference >= DEAF:
            return COLLISION
        if self._factor:
            return self._judge_lora(flight)
        if self._curve is None or not flight.words:
            return ""
        clear = flight.error_threshold = self._curve(flight, flight.snr_cdb)
        word = flight.words[Slot.ERROR]
        if word < clear:
            return SNR
        if flight.interference:
            flight.error_threshold = self._curve(flight, self._budget.ratio_cdb(flight))
        return COLLISION if word < flight.error_threshold else ""

    def _judge_lora(self, flight: Flight) -> str:
        """LoRa captures: a signal survives others that are together weaker by their spreading factor's isolation."""
        factor = self._factor
        power_dbm = flight.received_cdbm / 100.0
        if not lora_received(factor, power_dbm, self._is_gateway):
            flight.error_threshold = UNIT
            return OUT_OF_RANGE
        if not flight.by_factor:
            return ""
        others = [level_of(power) if power else None for power in flight.by_factor]
        return COLLISION if lora_interferer(factor, power_dbm, others) else ""
