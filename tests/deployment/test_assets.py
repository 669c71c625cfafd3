"""Files that a deployment refers to: read from inside its asset folder, from nowhere else, and pinned by digest."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Final

import pytest

from foosim.common import limits
from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import read_files
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.library.table.table_clearance import clearance_findings
from foosim.world.matter.mesh import AssetError, digest_of
from foosim.world.scene import Box
from foosim.world.scenery import path_problem

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
THINGS: Final = (
    "{shard: {shape: mesh, file: parts/shard.obj, scale: 0.02, z: 5 mm, surface: walls}, "
    "again: {shape: mesh, file: parts/shard.obj, x: 10 cm, surface: floor}, "
    "block: {shape: box, x: 1 m, length: 1 cm, width: 2 cm, height: 3 cm, yaw: 90 deg, surface: goal}}"
)


def with_scenery(things: str = THINGS, assets: str = "models") -> str:
    return apply_sets(TEXT, "table.yaml", [f"scenery={things}", f"assets={assets}"])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of a deployment, with its asset folder `models`; beside it a secret."""
    inner = tmp_path / "run"
    (inner / "models" / "parts").mkdir(parents=True)
    (inner / "models" / "parts" / "shard.obj").write_bytes(SHARD)
    (inner / "secret.obj").write_bytes(SHARD)
    (tmp_path / "secret.obj").write_bytes(SHARD)
    return inner


def test_files_are_read_once_and_pinned_in_the_text(folder: Path) -> None:
    text, files = pin_assets(with_scenery(), "table.yaml", folder)
    assert files == {"parts/shard.obj": SHARD}
    deployment = load_deployment(text, "table.yaml").with_assets(files)
    pinned = {name: getattr(thing, "digest", None) for name, thing in deployment.scenery.items()}
    assert pinned == {"shard": digest_of(SHARD), "again": digest_of(SHARD), "block": None}
    assert pin_assets(text, "table.yaml", folder) == (text, files), "pinning twice changes nothing"
    again, block, shard = deployment.scenery_shapes()
    assert isinstance(block.geometry, Box) and block.geometry.half == (0.005, 0.01, 0.015)
    assert shard.geometry.box == ((0.0, 0.0, 0.0), (0.02, 0.02, 0.02))  # type: ignore[union-attr]
    assert again.geometry.box[1] == (1.0, 1.0, 1.0)  # type: ignore[union-attr]


def test_a_file_that_changed_since_it_was_pinned_is_refused(folder: Path) -> None:
    text, _ = pin_assets(with_scenery(), "table.yaml", folder)
    (folder / "models" / "parts" / "shard.obj").write_bytes(SHARD + b"f 1 3 4\n")
    with pytest.raises(AssetError, match=r"^parts/shard\.obj: another file than the digest names"):
        pin_assets(text, "table.yaml", folder)


def test_a_deployment_without_meshes_reads_nothing(tmp_path: Path) -> None:
    text = with_scenery("{block: {shape: box, x: 1 m, length: 1 cm, width: 2 cm, height: 3 cm, surface: goal}}")
    assert pin_assets(text, "table.yaml", tmp_path / "absent") == (text, {})


PATHS: Final = {
    "../secret.obj": "no ..",
    "parts/../../secret.obj": "no ..",
    "parts/./shard.obj": "no .",
    "parts//shard.obj": "no empty component",
    "/etc/passwd.obj": "is relative",
    "~/secret.obj": "is relative",
    "\\\\host\\secret.obj": "is relative",
    "parts\\shard.obj": "letters, digits",
    "package://parts/shard.obj": "no scheme",
    "file:///secret.obj": "no scheme",
    "c:secret.obj": "no scheme",
    ".hidden.obj": "letters, digits",
    "-rf.obj": "letters, digits",
    "a b.obj": "letters, digits",
    "sh\u00e4rd.obj": "letters, digits",
    "a\nb.obj": "letters, digits",
    "a/" * 8 + "b.obj": "more than 8 components",
    "a" * 197 + ".obj": "more than 200 characters",
    "": "no empty component",
}


@pytest.mark.parametrize("path", PATHS)
def test_a_path_that_leads_out_is_refused_before_anything_is_opened(folder: Path, path: str) -> None:
    assert PATHS[path] in path_problem(path)
    written = path.replace("\\", "\\\\").replace("\n", "\\n")
    with pytest.raises(DeploymentError) as refusal:
        with_scenery(f'{{thing: {{shape: mesh, file: "{written}", surface: walls}}}}')
    assert PATHS[path] in str(refusal.value) and "scenery.thing.file" in str(refusal.value)
    with pytest.raises(AssetError):
        read_files(folder, "models", {path: None})


LINKS: Final = ["parts/link.obj", "inside.obj", "away/secret.obj", "parts/loop.obj"]


def test_a_file_that_does_not_exist_has_its_line_and_the_nearest_name(folder: Path) -> None:
    scenery = "scenery: {wall: {shape: mesh, file: parts/shrad.obj, scale: 0.02, x: 5 m, surface: walls}}"
    written = f"{TEXT}assets: models\n{scenery}\n"
    place, column = f"table.yaml:{written.count(chr(10))}", scenery.index("parts") + 1
    what = f"no such file in {folder / 'models'}, 'parts/shrad.obj', nearest is shard.obj"
    with pytest.raises(DeploymentError) as refusal:
        pin_assets(written, "table.yaml", folder)
    assert refusal.value.problems == (f"{place}:{column}: scenery.wall.file: {what}",)


@pytest.mark.parametrize("path", LINKS)
def test_links_are_not_followed_wherever_they_lead(folder: Path, path: str) -> None:
    models = folder / "models"
    (models / "parts" / "link.obj").symlink_to(folder / "secret.obj")
    (models / "inside.obj").symlink_to(models / "parts" / "shard.obj")
    (models / "away").symlink_to(folder)
    (models / "parts" / "loop.obj").symlink_to("loop.obj")
    with pytest.raises(AssetError, match=rf"^{path}: a symbolic link, or no folder, on the way"):
        read_files(folder, "models", {path: None})
    (folder / "elsewhere").symlink_to(models)
    with pytest.raises(AssetError, match="a symbolic link"):
        read_files(folder, "elsewhere", {"parts/shard.obj": None})


def test_what_is_no_file_is_refused_and_not_waited_for(folder: Path) -> None:
    os.mkfifo(folder / "models" / "pipe.obj")
    (folder / "models" / "folder.obj").mkdir()
    for name in ("pipe.obj", "folder.obj"):
        with pytest.raises(AssetError, match=rf"^{name}: no regular file$"):
            read_files(folder, "models", {name: None})
    with pytest.raises(AssetError, match=rf"^parts/absent\.obj: No such file or directory in {folder / 'models'}$"):
        read_files(folder, "models", {"parts/absent.obj": None})
    with pytest.raises(AssetError, match=r"absent: No such file or directory$"):
        read_files(folder / "absent", "models", {"a.obj": None})


def test_files_have_a_limit_each_and_together(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.obj", "b.obj"):
        (folder / "models" / name).write_bytes(bytes(600))
    monkeypatch.setattr(limits, "ASSETS_BYTES_MAX", 1000)
    with pytest.raises(AssetError, match=r"^b\.obj: the files up to this one have more than 1000 bytes$"):
        read_files(folder, "models", {"a.obj": None, "b.obj": None})
    monkeypatch.setattr(limits, "ASSET_BYTES_MAX", 599)
    with pytest.raises(AssetError, match=r"^a\.obj: more than 599 bytes$"):
        read_files(folder, "models", {"a.obj": None})


def test_meshes_have_a_limit_together(monkeypatch: pytest.MonkeyPatch) -> None:
    deployment = load_deployment(with_scenery(), "table.yaml")
    monkeypatch.setattr(limits, "SCENERY_TRIANGLES_MAX", 3)
    with pytest.raises(AssetError, match=r"4 triangles in the meshes up to scenery\.shard, at most 3 are allowed"):
        deployment.with_assets({"parts/shard.obj": SHARD})
    with pytest.raises(AssetError, match=r"the file of scenery\.again is missing"):
        deployment.with_assets({})


def test_what_is_wrong_with_files_has_the_line_of_the_file_as_written(folder: Path) -> None:
    """What is pinned is the canonical text, in which a mapping in braces takes several lines."""
    wall = "scenery: {wall: {shape: mesh, file: parts/shard.obj, scale: 0.02, x: 5 m, radio: {is: concrete}}}"
    written = f"{TEXT}assets: models\n{wall}\n"
    line = written.count("\n")
    with pytest.raises(DeploymentError, match=rf"^table\.yaml:{line}:[0-9]+: scenery\.wall\.radio"):
        pin_assets(apply_sets(written, "table.yaml", []), "table.yaml", folder)


def test_an_archive_is_not_unpacked(folder: Path) -> None:
    """What an archive's members are called does not matter, since nothing looks for them."""
    with zipfile.ZipFile(folder / "models" / "slip.obj", "w") as archive:
        archive.writestr("../../slipped.obj", SHARD)
    text = with_scenery("{thing: {shape: mesh, file: slip.obj, surface: walls}}")
    with pytest.raises(AssetError, match=r"^slip\.obj:1: a zero byte in a text$"):
        pin_assets(text, "table.yaml", folder)
    assert not (folder.parent / "slipped.obj").exists()


AUDIT: Final = """
import os, sys
from pathlib import Path
import foosim.library.table.table_clearance, foosim.world.mesh_files  # else imported with the first mesh
from foosim.deployment.assets import pin_assets
folder, opened, text = Path(sys.argv[1]), [], sys.stdin.read()
def watch(event, given):
    if event == "open":
        opened.append(given[0])
refused = []
for path in ("..", *sys.argv[2:]):  # the first time, modules are still imported
    if path == sys.argv[2]:
        sys.addaudithook(watch)
    try:
        pin_assets(text.replace("FILE", path), "t", folder)
    except Exception as error:
        refused.append(type(error).__name__)
print(*refused[1:], *(f"open {name}" for name in opened), sep="\\n")
"""


def test_nothing_outside_the_asset_folder_is_opened(folder: Path) -> None:
    """An audit hook sees every open: the folder, and then single components, each in the one before it."""
    models = folder / "models"
    (models / "link.obj").symlink_to(folder.parent / "secret.obj")
    (models / "away").symlink_to(folder.parent)
    text = with_scenery("{thing: {shape: mesh, file: FILE.obj, scale: 0.02, surface: walls}}")
    paths = ["parts/shard", "link", "away/secret", *(path.removesuffix(".obj") for path in PATHS if "\n" not in path)]
    done = subprocess.run(
        [sys.executable, "-c", AUDIT, str(folder), *paths], input=text, capture_output=True, text=True, check=True
    )
    lines = done.stdout.splitlines()
    refused = [line for line in lines if not line.startswith("open ")]
    assert refused == ["AssetError", "AssetError", *["DeploymentError"] * (len(paths) - 3)]
    opened = [line.removeprefix("open ") for line in lines if line.startswith("open ")]
    assert opened == [
        *(str(folder), "models", "parts", "shard.obj"),
        *(str(folder), "models", "link.obj"),
        *(str(folder), "models", "away"),
    ]


def test_scenery_is_what_the_deployment_says_and_nothing_else() -> None:
    plain = load_deployment(TEXT, "table.yaml")
    assert plain.scenery == {} and plain.scenery_shapes() == [] and plain.assets == "."
    deployment: Deployment = load_deployment(with_scenery(), "table.yaml")
    one, other = (deployment.with_assets({"parts/shard.obj": content}) for content in (SHARD, SHARD + b"f 1 3 4\n"))
    assert one == deployment.with_assets({"parts/shard.obj": SHARD, "else.obj": b""}) and one != other
    assert one.file_with(digest_of(SHARD)) == SHARD and one.file_with(digest_of(b"")) is None


PLATE: Final = b"""v -0.01 -0.01 0
v 0.01 -0.01 0
v 0.01 0.01 0
v -0.01 0.01 0
f 1 2 3
f 1 3 4
"""


def test_a_mesh_counts_when_its_file_is_there(tmp_path: Path) -> None:
    """Two triangles inside of the ball; and the same beside it."""
    (tmp_path / "plate.obj").write_bytes(PLATE)
    (tmp_path / "table.yaml").write_text(
        apply_sets(
            TABLE.read_text(),
            "t",
            [
                "scenery={inside: {shape: mesh, file: plate.obj, z: 1 cm},"
                " beside: {shape: mesh, file: plate.obj, x: 3 cm, z: 1 cm}}",
                "assets=.",
            ],
        )
    )
    text, files = pin_assets((tmp_path / "table.yaml").read_text(), "t", tmp_path)
    (found,) = clearance_findings(load_deployment(text, "t").with_assets(files))
    assert found.location == ("scenery", "inside", "x") and "kick-off spot" in found.what
    with pytest.raises(
        DeploymentError, match=r"table.yaml:[0-9]+:[0-9]+: scenery\.inside\.x: the ball at the kick-off"
    ):
        make_plan(RunOptions(tmp_path / "table.yaml"))
