"""What kinds of radios differ in: vehicles between vehicles (T18, T21), 802.11n (T16), LoRa's gateways.

The hall is the shipped warehouse, in which one rover between two others shadows them, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import wifi_airtime_ns
from foosim.vhub.radio.errors import DOT11N_MODES, LORA_GATEWAY_SENSITIVITY_DBM, LORA_SENSITIVITY_DBM, MODES
from foosim.vhub.radio.timings import WIFI_5, with_category
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from tests.links.offered import TABLE, deployment_of

HALL: Final = TABLE.parent / "warehouse.yaml"

# --- vehicles ---------------------------------------------------------------------------------------------------------


@cache
def hall(*sets: str) -> Deployment:
    """The warehouse without its scenery, its rovers with one radio each."""
    empty = "scenery={}", "network.links=[]", "network.events=[]", "network.robots={'*': [v]}"
    return load_deployment(apply_sets(HALL.read_text(), "hall.yaml", [*empty, *sets]), "hall.yaml")


def radio(environment: str, mount: str = "0 mm") -> str:
    settings = f"antenna: {{mount: [0 mm, 0 mm, {mount}]}}, path_loss: {{environment: {environment}}}"
    return f"network.radios={{v: {{preset: dot11p, shadowing: {{on: false}}, burst: null, jitter: null, {settings}}}}}"


def signal(
    deployment: Deployment, places: Mapping[str, tuple[float, float]], ends: tuple[str, str] = ("rover01", "rover02")
) -> Flight:
    """One packet between rovers that stand at places (m), all others far off."""
    start = initial_frame(deployment)
    values = start.values.copy()
    for number, entity in enumerate(start.layout.of("rover")):
        at = entity.offsets["position"]
        values[at : at + 2] = places.get(entity.name, (15.0, 11.0 - number))
    fabric = Fabric(deployment)
    fabric.turn_to(Frame(0, start.layout, values))
    flight = Flight(*ends, "beacon", 1, 0, 0, bytes(20))
    fabric.link(*ends, "beacon").send(flight)
    return flight


BETWEEN: Final = {"rover01": (-10.0, 0.0), "rover02": (2.0, 0.0), "rover03": (-4.0, 0.1)}


@pytest.mark.parametrize("environment", ["v2v_urban", "v2v_highway"])
def test_a_vehicle_between_vehicles_blocks_as_vehicles_do(environment: str) -> None:
    """TR 37.885's loss by the draw of the three, both ways, in every frame alike; its metal is not asked for."""
    deployment = hall(radio(environment))
    clear = signal(deployment, {**BETWEEN, "rover03": (-4.0, 5.0)})
    blocked = signal(deployment, BETWEEN)
    assert (clear.walls, clear.walls_cdb, blocked.walls) == ((), 0, ("rover03",))
    assert 0 < blocked.walls_cdb == blocked.path_loss_cdb - clear.path_loss_cdb < 2500
    back = signal(deployment, BETWEEN, ("rover02", "rover01"))
    moved = signal(deployment, {**BETWEEN, "rover03": (0.0, -0.1)})
    assert back.walls_cdb == moved.walls_cdb == blocked.walls_cdb
    other = signal(deployment, {"rover01": (-10.0, 0.0), "rover02": (2.0, 0.0), "rover04": (-4.0, 0.1)})
    assert other.walls_cdb not in (0, blocked.walls_cdb), "another vehicle, another draw"
    both = signal(deployment, {**BETWEEN, "rover04": (-1.0, 0.1)})
    assert both.walls_cdb == blocked.walls_cdb + other.walls_cdb
    indoors = signal(hall(radio("indoor")), BETWEEN)
    assert indoors.walls_cdb == 6000, "elsewhere it is the metal that it is of"


def test_antennas_above_the_hull_see_over_it() -> None:
    """The mast of one in between is on the line, its hull is not."""
    mast = "hall.rover.height=350 mm", "hall.rover.antenna_height=500 mm"
    over = signal(hall(*mast, radio("v2v_urban", "-50 mm")), {**BETWEEN, "rover03": (-4.0, 0.0)})
    assert (over.walls, over.walls_cdb) == (("rover03",), 0)


def test_scenery_is_not_called_like_a_robot() -> None:
    """What is in the way is told, and tried, by name."""
    box = "{shape: box, length: 1 m, width: 1 m, height: 1 m, x: 9 m, y: 9 m, surface: walls, radio: metal}"
    with pytest.raises(DeploymentError, match="scenery: a name that is also a robot's, 'rover01'"):
        hall(f"scenery={{rover01: {box}}}")


# --- 802.11n ----------------------------------------------------------------------------------------------------------


def sent(radio: str, distance_m: float, size: int, *, published: bool = False) -> Flight:
    """One packet of a to b, in free space, as the first of its run."""
    deployment = deployment_of(
        f"network.radios={{r: {{shadowing: {{on: false}}, path_loss: {{environment: free_space}}, {radio}}}}}",
        "network.robots={'*': [r]}",
        f"network.places={{a: [0 m, 0 m, 9 m], b: [{distance_m} m, 0 m, 9 m], '*': [0 m, 90 km, 9 m]}}",
    )
    flight = Flight("a", "b", "data", 1, 0, 0, bytes(size), published=published)
    Fabric(deployment).link("a", "b", "data").send(flight)
    return flight


WIFI: Final = "preset: wifi_5_indoor, jitter: null, burst: null, standard: 802.11n"


@pytest.mark.parametrize("size", [100, 1500])
def test_802_11n_has_its_rates(size: int) -> None:
    """Unicasts at MCS 7 near by and at lower ones farther off, each as long on air as the standard has it."""
    timing = with_category(WIFI_5, (3, 15, 1023))
    rates = []
    for distance_m in (5, 100, 200, 400, 800, 1600, 3200):
        flight = sent(WIFI, distance_m, size)
        (mode,) = [mode for mode in DOT11N_MODES if MODES[mode].rate_bps == flight.rate_bps]
        assert flight.airtime_ns == wifi_airtime_ns(mode, size, timing)
        rates.append(flight.rate_bps)
    assert rates[0] == 65_000_000 and rates == sorted(rates, reverse=True) and len(set(rates)) >= 5
    assert {*rates} <= {int(mbps * 1e6) for mbps in (6, 6.5, 13, 19.5, 26, 39, 52, 58.5, 65)}
    symbols = -(-(16 + 8 * (size + 36) + 6) // 260)
    assert sent(WIFI, 5, size).airtime_ns == 36_000 + 4_000 * symbols, "the mixed preamble is 16 us longer"
    assert sent(WIFI, 5, size, published=True).rate_bps == 6_000_000, "broadcasts are for stations of old, too"
    assert sent(WIFI.replace("802.11n", "802.11a/g"), 5, size).rate_bps == 54_000_000
    assert sent(f"{WIFI}, rates: fixed, fixed_rate: 39 Mbit/s", 5, size).rate_bps == 39_000_000


@pytest.mark.parametrize("radio", ["preset: dot11p", "medium: wifi, bandwidth: 40 MHz"])
def test_802_11n_is_in_20_mhz(radio: str) -> None:
    with pytest.raises(DeploymentError, match=r"not a bandwidth of 802.11n here, which has 20 MHz, '[14]0 MHz'"):
        sent(f"{radio}, standard: 802.11n", 5, 100)


# --- LoRa -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [7, 12])
def test_a_gateway_hears_what_a_device_does_not(factor: int) -> None:
    """Between the two sensitivities, and not below the gateway's."""
    device, gateway = LORA_SENSITIVITY_DBM[factor - 7], LORA_GATEWAY_SENSITIVITY_DBM[factor - 7]
    near = sent(f"preset: lora_eu868, loss: 0 %, spreading_factor: {factor}, tx_power: 0 dBm", 100, 20)
    for level, causes in ((device + 0.1, ("", "")), (device - 0.1, ("out_of_range", "")),
                          (gateway + 0.1, ("out_of_range", "")), (gateway - 0.1, ("out_of_range",) * 2)):  # fmt: skip
        power = f"tx_power: {level - near.received_cdbm / 100:.2f} dBm"
        lora = f"preset: lora_eu868, loss: 0 %, spreading_factor: {factor}, {power}"
        found = tuple(sent(f"{lora}, gateway: {is_gateway}", 100, 20).cause for is_gateway in ("false", "true"))
        assert found == causes
