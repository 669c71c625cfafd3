"""The page that is checked in is what its sources and the pinned libraries make, and its checkers find nothing.

Where npm is. The libraries are installed once, in the folder that `tools/page.sh` works in.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
PAGE = ROOT / "console" / "page"
WWW = ROOT / "console" / "www"
with_npm = pytest.mark.skipif(shutil.which("npm") is None, reason="npm is needed, with node 20 or newer")


def page(*arguments: str | Path) -> None:
    """Run tools/page.sh, which must succeed."""
    command = ["sh", ROOT / "tools" / "page.sh", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{arguments}:\n{done.stdout}\n{done.stderr}"


@with_npm
@pytest.mark.timeout(300)  # the first time the libraries are installed
def test_what_is_checked_in_is_what_the_sources_make(tmp_path: Path) -> None:
    page("check")
    page("build", tmp_path)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    kept = {path.name: path.read_bytes() for path in WWW.iterdir()}
    assert sorted(made) == sorted(kept)
    assert [name for name in made if made[name] != kept[name]] == [], "make page, and check in console/www"


def test_every_library_is_pinned_and_its_licence_is_served() -> None:
    package = json.loads((PAGE / "package.json").read_text())
    lock = json.loads((PAGE / "package-lock.json").read_text())["packages"]
    licences = (WWW / "licences.txt").read_text()
    for name, version in {**package["dependencies"], **package["devDependencies"]}.items():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version), name
        assert lock[f"node_modules/{name}"]["version"] == version
        assert lock[f"node_modules/{name}"]["integrity"].startswith("sha512-")
    for name, version in package["dependencies"].items():
        assert f"{name} {version} (" in licences
    hosts = {entry["resolved"].split("/")[2] for entry in lock.values() if "resolved" in entry}
    assert hosts <= {"registry.npmjs.org"}


def test_the_page_holds_to_its_policy() -> None:
    """Its Content-Security-Policy forbids scripts in the document and code out of strings."""
    index = (WWW / "index.html").read_text()
    assert re.findall(r"<script\b[^>]*>(?!</script>)", index) == []
    assert re.findall(r"\bon\w+=", index) == []
    named = re.findall(r'(?:src|href)="([^"]*)"', index)
    assert [name for name in named if not (WWW / name).is_file()] == []
    script = (WWW / "console.js").read_text()
    assert "new Function(" not in script
    assert not re.search(r"\beval\(", script)
