"""Tables of the kit by name: `table: {preset: us}` has all settings that the deployment leaves out.

Marks of a value: [S] read in the named source, [M] measured, [D] derived from these, [A] assumption without one.
A setting without a value in a preset is as in the German one.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

GERMAN: Final[Mapping[str, Any]] = {
    "gravity": "9.81 m/s2",  # [A] the usual value; 9.78 to 9.83 on Earth
    "field": {
        "length": "1200 mm",  # [S] kickerbau.org/kickerbau-masze.html; foosball.xml (kitaird/FoosballgoalieRL) 1217 mm
        "width": "680 mm",  # [S] the same two
    },
    "floor": {
        "thickness": "40 mm",  # [M] a 40 mm box lets nothing through at 0.5 ms
    },
    "walls": {
        "height": "150 mm",  # [A] real rails stand 120 to 150 mm above the field
        "thickness": "40 mm",  # [M] no ball passes up to 30 m/s at 0.5 ms
    },
    "goal": {
        "width": "220 mm",  # [D] from the wall boxes of foosball.xml (Darmstadt table)
        "height": "75 mm",  # [D] the same
        "depth": "100 mm",  # [A] a pocket that holds the ball
    },
    "ramps": {
        "height": "10.5 mm",  # [S] kickerbau-masze.html: corners lifted by 10 to 11 mm
        "leg": "230 mm",  # [D] 45-degree triangle from goal edge to side wall (kickerbau-masze.html): (680 - 220) / 2
    },
    # Of the ball with each: no measured values of real tables were found, these lie within what models use.
    "surfaces": {
        "floor": {
            "restitution": 0.5,  # [A] scvance/foosball_rl 0.5
            "friction": 0.3,  # [A] foosball.xml 0.10, teomaa/Foosball_CU 0.25 to 0.4
            "rolling_friction": "0.15 mm",  # [A] a ball at 1 m/s rolls for 10 to 20 s
        },
        "walls": {
            "restitution": 0.7,  # [A] robo-foosball-table ball_prediction.py 0.75, mbaske/ml-table-football 0.9
            "friction": 0.15,  # [A] foosball.xml 0.15; more makes a fast rolling ball hop over the wall [M]
            "rolling_friction": "0 mm",  # [A] contacts with a wall are short
        },
        "goal": {
            "restitution": 0.7,  # [A] as the walls
            "friction": 0.15,  # [A] as the walls
            "rolling_friction": "0 mm",  # [A] as the walls
        },
        "ramps": {
            "restitution": 0.5,  # [A] as the floor
            "friction": 0.3,  # [A] as the floor
            "rolling_friction": "0.15 mm",  # [A] as the floor
        },
        "figures": {
            "restitution": 0.6,  # [A] between floor and wall; kick speeds were measured with it
            "friction": 0.2,  # [A] foosball.xml 0.15, up to 0.30 for rough feet
            "rolling_friction": "0 mm",  # [A] contacts with a foot are short
        },
        "rods": {
            "restitution": 0.6,  # [A] as the figures
            "friction": 0.1,  # [A] polished steel
            "rolling_friction": "0 mm",  # [A] contacts with a rod are short
        },
        "balls": {  # of one ball with another: the table has one, others come by `add`
            "restitution": 0.8,  # [A] no source found; harder than a wall
            "friction": 0.2,  # [A] no source found; as the figures
        },
    },
    "ball": {
        "radius": "17.5 mm",  # [S] balls.com: 34.5 to 35 mm usual; Janssen et al., RoboCup 2009: about 3.5 cm
        "mass": "21 g",  # [S] foosball.xml (Darmstadt); Tornado urethane 27 g (kickerbau.org/baelle.html)
        "speed_limit": "40 m/s",  # [A] a promise; 15 m/s is the fastest reported (Moos et al., arXiv 2407.16606)
    },
    "rod": {
        "radius": "8 mm",  # [S] kickertisch-profi.de/kickerstange: 16 mm
        "inner_radius": "6 mm",  # [D] hollow rod of 16/12 mm: walls of 1 to 1.5 mm and more (kickerpedia.de stangen)
        "length": "1100 mm",  # [A] spans the field at either end of its stroke
        "axis_height": "84 mm",  # [S] kickerbau-masze.html, kickertischtuning-figuren.html (Darmstadt 78 mm)
        "mass": "900 g",  # [A] hollow steel of this size (a solid one has 1.8 kg)
        "carriage_mass": "50 g",  # [A] what slides but does not turn
        "figure_mass": "46 g",  # [S] kickerbau-figur-leonhart-soccer.html; foosball.xml
        "figure_com_below_axis": "16 mm",  # [A] within the figure's 100 mm; a pendulum of 0.607 s [M]
        "foot_radius": "72 mm",  # [S] kickertischtuning-figuren.html: 84 mm less 12 mm of clearance
        "foot": {
            "length": "15 mm",  # [A] the foot with which kicks and tunnelling were measured [M]
            "width": "24 mm",  # [A] the same
            "height": "30 mm",  # [A] the same
        },
        "body": {
            "length": "20 mm",  # [A] foosball.xml 25 mm
            "width": "22 mm",  # [A] foosball.xml 30 mm
            "height": "60 mm",  # [A] with the foot as long as foosball.xml's 100 mm
        },
    },
    "lines": {  # x as for red, whose goal is at -x; blue's are mirrored
        "goal": {
            "x": "-522 mm",  # [S] foosball.xml, and a public Isaac model of the same table
            "figures": 1,  # [S] foosball.xml; tischkicker.de (Tornado: 3)
            "pitch": "0 mm",  # [D] one figure
            "half_stroke": "123 mm",  # [S] the two models: 123 to 129 mm
        },
        "defence": {
            "x": "-373 mm",  # [S] the two models: 372.95 and 372.8 mm
            "figures": 2,  # [S] as above
            "pitch": "240 mm",  # [S] the two models: 232 to 247 mm
            "half_stroke": "179 mm",  # [S] the two models: 179 to 185 mm
        },
        "midfield": {
            "x": "-75 mm",  # [S] the two models: 74.7 and 75 mm
            "figures": 5,  # [S] as above
            "pitch": "121 mm",  # [S] the two models: 120.5 to 121 mm
            "half_stroke": "61.5 mm",  # [S] the two models: 57 to 61.5 mm
        },
        "attack": {
            "x": "224 mm",  # [S] the two models: 223.7 and 223.95 mm
            "figures": 3,  # [S] as above
            "pitch": "184 mm",  # [S] the two models: 183 to 184 mm
            "half_stroke": "118.5 mm",  # [S] the two models: 116 to 118.5 mm
        },
    },
    "drive": {  # position loop: wanted speed = gain (1/s) x error within +-speed, pursued with no more than the force
        "slide": {
            "speed": "3.5 m/s",  # [S] the Isaac model: 3.48 m/s
            "force": "90 N",  # [D] its 104 m/s2 on a rod of about 1 kg: 90 to 110 N
            "acceleration": "100 m/s2",  # [S] its 104 m/s2
            "gain": 30,  # [M] 0.3 a control period of 10 ms: within 1 mm of a 100 mm step in 136 ms, no overshoot
        },
        "spin": {
            "speed": "150 rad/s",  # [A] half of the Isaac model's 314 rad/s; a 15 m/s shot takes about 140 rad/s [D]
            "torque": "2 N m",  # [D] the Isaac model's 9425 rad/s2 on 2e-4 kg m2
            "acceleration": "9400 rad/s2",  # [S] the Isaac model's 9425 rad/s2, of rods with one figure, too
            "gain": 60,  # [A] below 2 x 9425 / 150 per second, so that the torque can brake in time
        },
    },
    "rules": {
        "kickoff": "conceded",  # [S] ITSF Standard Matchplay Rules, subsequent serves
        "kickoff_speed": "1 m/s",  # [A] a hand's throw
        "kickoff_delay": "500 ms",  # [A]
        "dead_ball": "spot",  # [A] where a dead ball comes back; `lines`: midway between the two lines where it lay
        "dead_ball_speed": "20 mm/s",  # [A] slower than a figure can still reach it in time
        "dead_ball_after": "3 s",  # [A]
        "off_table_after": "500 ms",  # [A]
        "out_margin": "1 m",  # [A] the world ends this far outside the table
        "match": {  # ends with whichever is first; without this section play has no end
            "duration": "10 min",  # [A] of play: the clock stands while the ball waits for its kick-off
            "goals": 10,  # [A] usual in German pubs; ITSF has sets of 5
        },
    },
    "contact_erp": 0.01,  # [M] restitution is right to +0.01; 0 is exact, but a pinned ball sinks by 0.5 mm
    "solver_iterations": 50,  # [M] 20, 50 and 200 cost the same and give the same
}
"""The German table, 1200 x 680 mm, that of deploy/table.yaml."""

US: Final[Mapping[str, Any]] = {
    "field": {
        "length": "1168 mm",  # [S] Camty1/RayFoosball:Code/simulation/foosballGym.py, a Tornado: 46 in
        "width": "679 mm",  # [S] the same: 26.75 in
    },
    "goal": {
        "width": "205 mm",  # [A] the narrow end of 205 to 220 mm
    },
    "ramps": {
        "leg": "237 mm",  # [D] from goal edge to side wall: (679 - 205) / 2
    },
    "ball": {
        "radius": "17.5 mm",  # [S] kickerbau.org/baelle.html: urethane, 35 mm
        "mass": "27 g",  # [S] the same
    },
    "rod": {
        "radius": "7.95 mm",  # [S] tischkicker.de, Tornado: 15.9 mm
    },
    "lines": {  # [D] as far from the end walls as the figures swing, at equal distances; Tornado's own were not found
        "goal": {
            "x": "-507 mm",  # [D] a foot that is level clears the wall by 4 mm
            "figures": 3,  # [S] tischkicker.de, Tornado
            "pitch": "237 mm",  # [D] the outer ones reach the side walls: (679 - 24 - 181) / 2
            "half_stroke": "90.5 mm",  # [S] RayFoosball: 181 mm in all
        },
        "defence": {
            "x": "-362.14 mm",  # [D] 5/7 of it
            "half_stroke": "176.5 mm",  # [S] RayFoosball: 353 mm in all
        },
        "midfield": {
            "x": "-72.43 mm",  # [D] 1/7 of it
            "half_stroke": "56 mm",  # [S] RayFoosball: 112 mm in all
        },
        "attack": {
            "x": "217.28 mm",  # [D] 3/7 of it
            "half_stroke": "113 mm",  # [S] RayFoosball: 226 mm in all
        },
    },
}
"""A US table, like a Tornado, 1168 x 679 mm, with three figures before the goal."""

SMALL: Final[Mapping[str, Any]] = {
    "field": {
        "length": "1170 mm",  # [S] juanmartosjimenez/robo-foosball-table:camera/camera_measurements.py
        "width": "631 mm",  # [S] the same
    },
    "ramps": {
        "leg": "205.5 mm",  # [D] from goal edge to side wall: (631 - 220) / 2
    },
    "lines": {  # [D] as far from the end walls as the German table's, within 1 mm, at equal distances
        "goal": {
            "x": "-507.5 mm",  # [D] 77.5 mm from the wall
        },
        "defence": {
            "x": "-362.5 mm",  # [D] 5/7 of it
        },
        "midfield": {
            "x": "-72.5 mm",  # [D] 1/7 of it
        },
        "attack": {
            "x": "217.5 mm",  # [D] 3/7 of it
        },
    },
}
"""A small table, 1170 x 631 mm."""


def _over(base: Mapping[str, Any], own: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a preset with the differences of another one."""
    return {
        **base,
        **{
            key: _over(base[key], value) if isinstance(value, Mapping) and key in base else value
            for key, value in own.items()
        },
    }


PRESETS: Final[Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {"german": GERMAN, "us": _over(GERMAN, US), "small": _over(GERMAN, SMALL)}
)
"""The presets by name."""
