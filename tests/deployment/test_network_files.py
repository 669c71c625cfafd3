"""Files that links are made from: read from the asset folder, pinned, checked, and used by the vHub."""

from pathlib import Path

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.traces import file_settings, read_opportunities, read_table
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.world.matter.mesh import AssetError, digest_of

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
RULES = (
    "[{id: jittered, from: camera, to: '*', jitter: {shape: table, file: some.dist, mean: 10 ms, sd: 1 ms}},"
    " {id: traced, from: red.goal, to: '*', trace: {file: some.trace}}]"
)
FILES = {"some.dist": b"# three deviations\n-16384 0\n16384\n", "some.trace": b"10\n20\n25\n"}


def text() -> str:
    return apply_sets(TABLE.read_text(), TABLE.name, [f"network.links={RULES}"])


def folder(tmp_path: Path, **changed: bytes) -> Path:
    for path, content in FILES.items():
        (tmp_path / path).write_bytes(changed.get(path.rpartition(".")[2], content))
    return tmp_path


def test_files_are_pinned_by_their_digests_and_come_with_the_deployment(tmp_path: Path) -> None:
    pinned, files = pin_assets(text(), TABLE.name, folder(tmp_path))
    assert files == FILES
    deployment = load_deployment(pinned, TABLE.name)
    named = {setting.file: setting.digest for _, setting in file_settings(deployment.network)}
    assert named == {path: digest_of(content) for path, content in FILES.items()} == deployment.files()
    with pytest.raises(AssetError, match=r"some\.trace"):
        deployment.with_assets({**files, "some.trace": b"10\n"})


def test_the_vhub_draws_from_a_table_and_waits_for_opportunities(tmp_path: Path) -> None:
    pinned, files = pin_assets(text(), TABLE.name, folder(tmp_path))
    fabric = Fabric(load_deployment(pinned, TABLE.name).with_assets(files))
    jitters = []
    for number in range(500):
        flight = Flight("camera", "player-red", "ball", number, number * 10**9, 0, b"x")
        assert fabric.link("camera", "player-red", "ball").send(flight)
        jitters.append(flight.jitter_ns)
    assert 8_000_000 <= min(jitters) < 8_100_000 and 11_900_000 < max(jitters) <= 12_000_000
    due = []
    for number in range(4):
        flight = Flight("red.goal", "player-red", "encoder", number, 0, 0, bytes(1500))
        assert fabric.link("red.goal", "player-red", "encoder").send(flight)
        due.append(flight.due_ns // 1_000_000)
    assert due == [10, 20, 25, 35]


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"dist": b"1 x\n"}, "some.dist: line 1: not a whole number, 'x'"),
        ({"dist": b"1\n"}, "some.dist: fewer than two numbers"),
        ({"dist": b"\xff"}, "some.dist: not a text of plain ASCII"),
        ({"trace": b"20\n10\n"}, "some.trace: line 2: 10 ms after 20 ms, times ascend"),
        ({"trace": b"-1\n"}, "some.trace: line 1: not a whole number of ms, '-1'"),
        ({"trace": b"\n"}, "some.trace: no time after 0 ms"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_line(tmp_path: Path, changed: dict[str, bytes], problem: str) -> None:
    with pytest.raises(AssetError) as refused:
        pin_assets(text(), TABLE.name, folder(tmp_path, **changed))
    assert str(refused.value) == problem


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    what = r"^\S+:\d+:\d+: network\.links\[0\]\.jitter\.file: no such file in .*, 'some\.dist'"
    with pytest.raises(DeploymentError, match=what):
        pin_assets(text(), TABLE.name, tmp_path)


def test_what_the_files_hold_is_read_as_written() -> None:
    assert read_opportunities("5\n5 # twice\n\n9\n") == (5, 5, 9)
    assert read_table("3 -1\n2") == (-1, 2, 3)
