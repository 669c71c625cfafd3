"""Deployments of format 1, which captures may have, too.

The noise of a sensor was settings of its own, which are a modifier now. A file of format 1 is read as if it said so.
"""

from typing import Final

from foosim.deployment.text.yaml import Fields, Items, Leaf, Tree
from foosim.world.forms.earlier_noise import NOISE

FORMAT: Final = 2


def upgrade(tree: Tree | None) -> None:
    """Make a tree of format 1 one of today's, in place; any other is left as it is."""
    stated = tree.values.get("format") if isinstance(tree, Fields) else None
    if (
        not isinstance(tree, Fields)
        or not isinstance(stated, Leaf)
        or stated.value != 1
        or type(stated.value) is not int
    ):
        return
    tree.values["format"] = Leaf(stated.place, FORMAT)
    robots = tree.values.get("robots")
    for robot in robots.values.values() if isinstance(robots, Fields) else ():
        sensors = robot.values.get("sensors") if isinstance(robot, Fields) else None
        for sensor in sensors.values.values() if isinstance(sensors, Fields) else ():
            if isinstance(sensor, Fields):
                _upgrade_sensor(sensor)


def _upgrade_sensor(sensor: Fields) -> None:
    kind = sensor.values.get("kind")
    known = NOISE.get(str(kind.value), {}) if isinstance(kind, Leaf) else {}
    given = [key for key in known if key in sensor.values]
    if not given:
        return
    place = sensor.keys[given[0]]
    std = Fields(place)
    for key in given:
        value, at = sensor.values.pop(key), sensor.keys.pop(key)
        for field in known[key]:
            std.values[field], std.keys[field] = value, at
    noise = Fields(place, {"kind": Leaf(place, "gaussian_noise"), "std": std}, {"kind": place, "std": place})
    sensor.values["modifiers"], sensor.keys["modifiers"] = Items(place, [noise]), place
