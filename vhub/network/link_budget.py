"""The budget of one radio link: the received power of a packet, and its ratio to noise and interference."""

from __future__ import annotations

from foosim.common.keyed_random import draw_key
from foosim.deployment.network.radios import Fading
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.fading import fading_db, nakagami_m
from foosim.vhub.radio.noise import centi, ratio_cdb
from foosim.vhub.radio.propagation import NOWHERE, OUT_OF_RANGE, Path, Propagation


class Budget:
    """Writes a packet's radio inputs, at sending. The two directions of a pair share their fading."""

    def __init__(self, propagation: Propagation, source: str, destination: str, seed: int, air: str) -> None:
        self.propagation = propagation
        self._world = propagation.world
        self._source, self._destination = source, destination
        settings = propagation.settings
        self._fading: Fading | None = settings.fading
        first, second = sorted((self._world.body(source), self._world.body(destination)))
        self._key = draw_key(seed, "fading", air, first, second)
        self._sensitivity_cdbm = centi(settings.sensitivity_dbm)
        self._speed_mm_ns = settings.speed_m_s * 1e-6
        self._turns = -1
        self._path = NOWHERE
        self._block, self._parameter, self._fading_cdb = -1, 0.0, 0

    def path(self) -> Path:
        """Return the path between the ends in the newest frame."""
        if self._turns != self._world.turns:
            of, source, destination = self.propagation, self._source, self._destination
            self._path = of.path(of.place(source), of.place(destination))
            self._turns = self._world.turns
        return self._path

    def measure(self, flight: Flight) -> str:
        """Set the received power; return why nothing is received, or an empty string."""
        path, of = self.path(), self.propagation
        distance_mm, loss_cdb = path.distance_mm, path.loss_cdb
        flight.distance_mm, flight.walls, flight.walls_cdb = distance_mm, path.walls, path.walls_cdb
        flight.propagation_ns = int(distance_mm / self._speed_mm_ns)
        if path.cause:
            return path.cause
        flight.shadowing_cdb = path.shadowing_cdb
        if self._fading is not None:
            flight.fading_cdb = self._fade(self._fading, flight.sent_ns, distance_mm)
            loss_cdb -= flight.fading_cdb
        flight.path_loss_cdb = loss_cdb
        flight.received_cdbm = received_cdbm = of.power_cdbm + of.gain_cdb - loss_cdb
        flight.snr_cdb = received_cdbm - of.noise_cdbm
        return OUT_OF_RANGE if received_cdbm < self._sensitivity_cdbm else ""

    def ratio_cdb(self, flight: Flight) -> int:
        """Return the ratio of a packet's signal to noise and interference (SINR)."""
        return ratio_cdb(flight.received_cdbm, self.propagation.noise_cdbm, flight.interference)

    def _fade(self, fading: Fading, time_ns: int, distance_mm: int) -> int:
        """Return the fading, which is constant within a block of time."""
        parameter = fading.k_db
        if fading.kind == "nakagami":
            parameter = nakagami_m(distance_mm / 1000.0) if fading.m is None else fading.m
        block = time_ns // fading.coherence_ns
        if block != self._block or parameter != self._parameter:
            self._block, self._parameter = block, parameter
            self._fading_cdb = centi(fading_db(self._key, block, fading.kind, parameter))
        return self._fading_cdb
