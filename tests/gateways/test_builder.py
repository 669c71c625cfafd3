"""Scripts of MORSE's builder become deployments, or all their problems."""

import os
from collections.abc import Callable
from pathlib import Path
from select import select
from textwrap import dedent
from typing import Any, Final

import pytest
import yaml

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.gateways.builder import script
from foosim.gateways.builder.export import data
from foosim.gateways.table import ROWS
from foosim.world.scene import rotate
from tests.conftest import Typed

Export = Callable[..., dict[str, Any]]
HEAD: Final = "from morse.builder import *\n"
HUNT: Final = """\
cat = ATRV()
cat.translate(x=-6.0, z=0.2)
eyeL = SemanticCamera()
eyeL.translate(x=0.2, y=0.3, z=0.9)
cat.append(eyeL)
motion = MotionVW()
cat.append(motion)
for part in (eyeL, motion):
    part.add_stream('socket')
mouse = ATRV()
mouse.properties(Object=True, Graspable=False, Label="MOUSE")
mouse.translate(1, 2)
mouse.rotate(z=1.5)
keys = Keyboard()
keys.properties(Speed=3.0)
mouse.append(keys)
env = Environment('land-1/trees')
env.set_camera_location([10.0, -10.0, 10.0])
"""


@pytest.fixture
def export(tmp_path: Path) -> Export:
    """Return a function that exports a script, by its text below the import, and returns the deployment's data."""

    def exported(text: str, nodes: int | None = None, limit_s: int = 20) -> dict[str, Any]:
        file = tmp_path / "game.py"
        file.write_text(HEAD + dedent(text))
        made: dict[str, Any] = yaml.safe_load(script.export(file, nodes, limit_s))
        return made

    return exported


def problems_of(export: Export, text: str, limit_s: int = 20) -> list[str]:
    with pytest.raises(DeploymentError) as refused:
        export(text, limit_s=limit_s)
    return list(refused.value.problems)


def test_cat_and_mouse(tmp_path: Path, typed: Typed) -> None:
    file, first, second = tmp_path / "hunt.py", tmp_path / "first.yaml", tmp_path / "second.yaml"
    file.write_text(HEAD + HUNT)
    for output in (first, second):
        assert typed("morse", "export")(file, "-o", output) == (0, "", "")
    assert first.read_bytes() == second.read_bytes()
    deployment = load_deployment(first.read_text(), "hunt")
    cat, mouse = deployment.robots["cat"], deployment.robots["mouse"]
    eye = cat.sensors["eyel"]
    assert (eye.kind, eye.label, float(eye.rate_hz)) == ("semantic_camera", "eyeL", 20.0)
    assert eye.at.position == (0.2, 0.3, 1.0)  # type: ignore[attr-defined]  # MORSE's origin is 10 cm above the ground
    assert (mouse.label, mouse.tags, cat.label, cat.tags) == ("MOUSE", ["object"], "", [])
    assert (mouse.at.position, mouse.at.yaw) == ((1.0, 2.0, 0.0), 1.5)  # type: ignore[attr-defined]
    assert (mouse.actuators["keys"].kind, mouse.speed) == ("v_w", 3.0)  # type: ignore[attr-defined]
    assert deployment.console == "console" and deployment.gateways["socket"].robots == ["cat", "mouse"]
    assert len(deployment.scenery) == 50
    assert "hunt.py:19: Environment.set_camera_location has no effect here." in first.read_text()
    result = typed("rehearse")(first, "--for", "200ms", "--nodes", "2")
    assert result.code == 0, result.err


def test_run_has_the_nodes_and_the_options_of_up(tmp_path: Path, typed: Typed) -> None:
    file = tmp_path / "hunt.py"
    file.write_text(HEAD + HUNT)
    done = typed("morse", "run")(file, "--nodes", "2", "--no-capture", "--pace", "2y")
    assert (done.code, done.err.count("--pace: not a pace")) == (2, 1), done.err
    (made,) = (tmp_path / "state").rglob("hunt.yaml")
    assert made.read_text() == script.export(file, 2)


def test_names_are_those_of_variables(export: Export) -> None:
    made = export("""
        class Mine(Morsy):
            def __init__(self, name=None):
                Morsy.__init__(self, name)
                self.eye = VideoCamera()
                self.append(self.eye)

        first, second = Mine(), Mine('Foo')
        for number in range(3):
            robot = Morsy()
            robot.translate(x=3.0 + 3 * number)
            unit = StereoUnit()
            robot.append(unit)
            Left = Pose()
            unit.append(Left)
            twin = Pose('twin')
            robot.append(twin)
            other = Pose('twin')
            robot.append(other)
            AbstractComponent.close_context()
        second.translate(y=5)
        for number, one in enumerate((first, second)):
            one.translate(y=-8 * number - 4)
        env = Environment('empty', fastmode=True)
    """)
    assert [*made["robots"]] == ["first", "foo", "robot", "robot_001", "robot_002"]
    assert made["robots"]["foo"] == {"like": "morsy", "label": "Foo", "at": {"y": "-7 m"}}
    assert [*made["templates"]["morsy"]["sensors"]] == ["eye"]
    sensors = made["templates"]["morsy-2"]["sensors"]
    assert {name: one.get("label") for name, one in sensors.items()} == {
        "unit-left": "unit.Left",
        "twin": None,
        "twin_001": None,
    }


def test_a_component_is_where_it_is_on_what_holds_it(export: Export) -> None:
    made = export("""
        robot = RMax()
        robot.translate(z=10)
        unit = StereoUnit()
        unit.translate(1, 2, 3)
        unit.rotate(0.1, 0.2, 0.3)
        eye = VideoCamera()
        eye.translate(x=0.5)
        eye.rotate(z=-0.4)
        robot.append(unit)
        unit.append(eye)
        env = Environment('empty')
    """)
    deployment = load_deployment(yaml.safe_dump(made), "game")
    robot = deployment.robots["robot"]
    at = robot.sensors["unit-eye"].at  # type: ignore[attr-defined]
    turned = type(at)(roll="0.1 rad", pitch="0.2 rad", yaw="0.3 rad").orientation
    origin = (1.0, 2.0, 3.44)
    assert at.position == pytest.approx([a + b for a, b in zip(origin, rotate(turned, (0.5, 0, 0)), strict=True)])
    ahead = rotate(turned, rotate(type(at)(yaw="-0.4 rad").orientation, (1.0, 0.0, 0.0)))
    assert rotate(at.orientation, (1.0, 0.0, 0.0)) == pytest.approx(ahead)
    assert robot.at.z == pytest.approx(10 - 0.44)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        ("", {"tick": "16666666 ns", "pace": "realtime", "rate": "60 Hz"}),
        ("env.set_time_strategy(TimeStrategies.FixedSimulationStep)", {"pace": "fast"}),
        ("env.set_time_scale(accelerate_by=2)", {"pace": "2x"}),
        ("env.set_time_scale(slowdown_by=2)", {"pace": "0.5x"}),
        ("env.simulator_frequency(50)", {"tick": "20 ms", "rate": "50 Hz"}),
        ("env.simulator_frequency(90)", {"tick": "11111110 ns", "substeps": 2, "rate": "60 Hz"}),
        ("pose.frequency(1000)", {"tick": "1 ms", "rate": "1 kHz", "poses": "50 Hz"}),
        ("env.set_gravity(1.62)", {"physics": {"gravity": "1.62 m/s2"}}),
        ("env.set_physics_step_sub(5)", {"substeps": 5, "tick": "16666665 ns"}),
        (
            "env.configure_stream_manager('socket', time_sync=True, sync_port=5000)",
            {"sync": {"port": 5000, "rate": "500000000/8333333 Hz"}},
        ),
        (
            "env.properties(longitude=43.6, latitude=1.4333, altitude=135.0)",
            {"origin": {"latitude": "1.4333 deg", "longitude": "43.6 deg", "altitude": "135.0 m", "heading": "90 deg"}},
        ),
        ("pose.add_stream('yarp')", {"gateways": {"yarp": {"kind": "yarp"}}}),
        (
            "pose.add_stream('text')\npose.add_service('pocolibs')",
            {
                "gateways": {
                    "text": {"kind": "text", "robots": ["robot"]},
                    "tclserv": {"kind": "tclserv", "robots": ["robot"]},
                }
            },
        ),
        (
            "pose.add_stream('yarp', port='/here')",
            {"gateways": {"yarp": {"kind": "yarp", "ports": {"robot.pose": "/here"}}}},
        ),
        (
            "pose.alter('UTM', x_offset=1e8)\nenv.properties(UTMXOffset=5, UTMYOffset=-4242)",
            {"gateways": {"socket": {"kind": "socket", "alter": {"robot.pose": ["UTM 100000000.0 -4242.0 0.0"]}}}},
        ),
        (
            "box = Cube('box')\nbox.translate(3, 4, 1)\nbox.scale = (0.5, 0.5, 1)\nbox.properties(Object=True)",
            {"at": {"x": "3 m", "y": "4 m", "z": "1 m"}, "size": ["1.0 m", "1.0 m", "2 m"], "tags": ["object"]},
        ),
        (
            "power = Battery()\nrobot.append(power)\nspot = Zone(type='Charging')\nspot.size = (3, 4, 1)",
            {"idle": "0.05 kW", "chargers": [{"x": "0 m", "y": "0 m", "radius": "5 m", "power": "0.1 kW"}]},
        ),
        ("pose.alter('NED')", {"gateways": {"socket": {"kind": "socket", "alter": {"robot.pose": ["NED"]}}}}),
        (
            "pose.alter('PoseNoise', pos_std=0.5)",
            {"modifiers": [{"kind": "gaussian_noise", "std": {"position": "0.5 m"}}]},
        ),
    ],
)
def test_settings(export: Export, lines: str, found: dict[str, Any]) -> None:
    made = export(f"robot = ATRV()\npose = Pose()\nrobot.append(pose)\nenv = Environment('empty')\n{lines}\n")
    pose, socket = made["robots"]["robot"]["sensors"]["pose"], made["gateways"].get("socket", {})
    robot, objects = made["robots"]["robot"], made.get("objects", {})
    pose = {**pose, **objects.get("box", {}), **robot.get("rules", {}).get("battery", {})}
    known = {**pose, "sync": socket.get("sync"), **made["capture"], **made}
    assert {key: known[key] for key in found} == {
        key: "1000 Hz" if value == "1 kHz" else value for key, value in found.items()
    }


def test_nodes(export: Export) -> None:
    text = """
        for name in 'abcde':
            robot = ATRV(name)
            robot.translate(x=3.0 * len(AbstractComponent.made))
        env = Environment('empty')
        env.configure_multinode(protocol='socket', distribution={'Left': ['b'], 'Right': ['c', 'd']})
    """
    assert export(text)["nodes"] == {"left": {"robots": ["b", "a", "e"]}, "right": {"robots": ["c", "d"]}}
    assert export(text, nodes=2)["nodes"] == {"n1": {"robots": ["a", "b"]}, "n2": {"robots": ["c", "d", "e"]}}


def test_what_has_no_effect_is_noted_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "game.py"
    text = """\
        robot = ATRV()
        robot.rotate(x=0.1)
        robot.set_mass(30)
        robot.properties(Weight=3, Cost=4)
        pose = Pose()
        pose.properties(Zeal=1, Ardour=2, Bloom=3)
        robot.append(pose)
        mast = Cylinder('mast')
        mast.color(1, 0, 0)
        robot.append(mast)
        env = Environment('empty')
        env.select_display_camera(pose)
        env.fullscreen()
    """
    file.write_text(HEAD + dedent(text))
    notes = [line.split()[1] for line in script.export(file).splitlines() if line.startswith("# game.py")]
    assert notes == [f"game.py:{line}:" for line in (13, 2, 5, 5, 7, 7, 7, 10, 4)]


def test_all_that_is_unsupported_is_named_at_once_with_its_line(tmp_path: Path, typed: Typed) -> None:
    file = tmp_path / "game.py"
    file.write_text(
        HEAD
        + dedent("""\
        human = Human()
        robot = ATRV()
        drive, slide = MotionVW(), MotionXYW()
        robot.append(drive)
        robot.append(slide)
        robot.append(ATRV())
        drive.add_stream('ros', topic='/drive')
        pose = Pose()
        pose.level('fine')
        robot.append(pose)
        pose.alter('Wobble')
        pose.jump(3)
        bpymorse.get_object('Cube')
        lost = Pose()
        table = PassiveObject('props/objects', 'SmallTable')
        env = Environment('land-1/forest')
        env.configure_multinode(protocol='hla', distribution={'n': ['nobody']})
        env.fly()
    """)
    )
    done = typed("morse", "export")(file, "-o", tmp_path / "made.yaml")
    assert done.code == 2 and not (tmp_path / "made.yaml").exists()
    lines = [line.split(": ")[0].partition(":")[2] for line in done.err.splitlines()]
    assert lines == ["", *map(str, (2, 3, 7, 8, 9, 12, 13, 14, 15, 16, 17, 18, 19))]


def test_a_problem_of_the_deployment_has_the_line_of_the_script(export: Export) -> None:
    (problem,) = problems_of(export, "one = ATRV()\ntwo = ATRV()\nenv = Environment('empty')\n")
    assert problem == "game.py:3: robots.two.at: the robot starts in the robot one, '0 m, 0 m, 0 m'"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("while True: pass\n", "game.py:2: the script still runs after 1 s, which is its limit"),
        (
            "import time\ntry:\n    time.sleep(60)\nexcept BaseException:\n    pass\n",
            "game.py:4: the script still runs after 1 s, which is its limit",
        ),
        ("raise ValueError('no')", "game.py:2: the script has raised ValueError: no"),
        ("robot = ATRV('a.b')", "game.py:2: the script has raised SyntaxError: Invalid component name: <a.b>"),
        ("import os\nos._exit(5)", "game.py: the script has ended without a result, code 5"),
        (
            "import os\nif os.fork():\n    os.wait()\n    os._exit(7)\nr = ATRV()\ne = Environment('empty')",
            "game.py: the script has ended without a result, code 7",
        ),
        ("exit(3)", "game.py: the script has ended with exit code 3"),
        (
            "p = Pose()\np.frequency('x')\nr = ATRV()\nr.append(p)\ne = Environment('empty')",
            "game.py:4: ATRV has a wrong value: TypeError(",
        ),
        ("robot = ATRV()", "game.py: a script makes one Environment; this one has made 0"),
        (
            "for _ in range(2**14):\n    ATRV().name = 'n' * 256",
            "game.py: the script has made more than 8 MiB of things",
        ),
        ("x = 'x' * 2**40", "game.py:2: the script has raised MemoryError: "),
    ],
)
def test_a_script_that_goes_wrong(export: Export, text: str, problem: str) -> None:
    assert problems_of(export, text, limit_s=1)[0].startswith(problem)


def test_a_script_prints_forks_and_exits(export: Export, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "alive")
    reader = os.open(tmp_path / "alive", os.O_RDONLY | os.O_NONBLOCK)
    made = export("""
        import os, sys
        child = os.fork()
        if child == 0:
            alive = open('alive', 'w')
            robots = [ATRV(), ATRV()]
        else:
            print('printed')
            robot = ATRV()
        env = Environment('empty')
        while child == 0:
            pass
        sys.exit(0)
    """)
    assert [*made["robots"]] == ["robot"]
    assert capfd.readouterr() == ("", "printed\n")
    assert select([reader], [], [], 20.0)[0], "the child lives: it holds the pipe open"
    assert os.read(reader, 1) == b""
    os.close(reader)


def test_every_class_and_scene_of_the_tables_makes_a_valid_deployment(export: Export) -> None:
    classes, robots = data("components.yaml")["classes"], data("robots.yaml")
    carrier = {model: name for name, its in robots["robots"].items() for model in robots["families"][its["family"]]}
    lines: list[str] = []
    parts = [(name, carrier[entry.get("models", ["holonomic"])[0]]) for name, entry in classes["sensors"].items()]
    parts += [(name, carrier[entry["models"][0]]) for name, entry in classes["actuators"].items()]
    parts += [("Pose", name) for name in robots["robots"]]
    for number, (part, robot) in enumerate(parts):
        lines += [
            f"r{number} = {robot}()",
            f"r{number}.translate({10 * (number % 9) - 40}, {10 * (number // 9) - 30}, 5)",
        ]
        lines += [f"p = {part}()", f"r{number}.append(p)", "p.add_interface('socket')"]
    where = ["env.properties(longitude=0.0, latitude=50.0)"]
    lines.append("r0.properties(Object=True)")
    made = export("\n".join([*lines, "env = Environment('land-1/trees')", *where]))
    assert len(made["robots"]) == len(parts)
    for scene in data("scenes.yaml"):
        assert export(f"robot = ATRV()\nrobot.translate(5, -8)\nenv = Environment('{scene}')\n")["robots"]


def test_classes_of_the_table_are_those_of_the_rows() -> None:
    rows = {(row.kind, row.morse) for row in ROWS}
    for section in ("sensors", "actuators"):
        for name, entry in data("components.yaml")["classes"][section].items():
            for level in ({}, *entry.get("levels", {}).values()):
                its = {"row": name, **entry, **level}
                assert (its["kind"], its["row"]) in rows
