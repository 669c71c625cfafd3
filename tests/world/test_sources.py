"""The version of a component follows all sources that it is made of, and no others."""

from __future__ import annotations

import py_compile
import sys
from collections.abc import Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.world.assembly import versions
from foosim.world.assembly.versions import sources_of

FILES: Final = {
    "first_own.py": "import json, second_own\nfrom foosim.common import units\nclass Form: pass\n",
    "second_own.py": "def late():\n    import third_own\n",
    "third_own.py": "import nowhere_at_all\nF = 1\n",
    "apart_own.py": "G = 1\n",
    "based_own.py": "from first_own import Form\nclass Based(Form): pass\n",
    "pack_own/__init__.py": "",
    "pack_own/forms/__init__.py": "H = 1\n",
    "pack_own/forms/one.py": "from ..common import near\nfrom . import other\nclass Form: pass\n",
    "pack_own/forms/other.py": "",
    "pack_own/common.py": "near = 1\n",
    "pack_own/unused.py": "",
    "space_own/one.py": "from space_own import two\nclass Form: pass\n",
    "space_own/two.py": "",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    forget()
    yield tmp_path
    forget()


def forget() -> None:
    for module in [name for name in sys.modules if name.partition(".")[0].endswith("_own")]:
        del sys.modules[module]
    for kept in (versions._spec, versions._source, versions._imports, versions._folder):
        kept.cache_clear()
    invalidate_caches()


def made(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


def test_modules_beside_each_other_are_one_form(folder: Path) -> None:
    """With imports of imports, also those within functions; nothing of Python, of foosim or of what is not imported."""
    found = sources_of(made("first_own", "Form"))
    assert list(found) == ["first_own", "second_own", "third_own"]
    assert found["third_own"] == FILES["third_own.py"].encode()


def test_base_classes_count(folder: Path) -> None:
    found = sources_of(made("based_own", "Based"))
    assert list(found) == ["based_own", "first_own", "second_own", "third_own"]


def test_of_a_package_what_is_imported_counts(folder: Path) -> None:
    found = sources_of(made("pack_own.forms.one", "Form"))
    package = ["pack_own", "pack_own.common", "pack_own.forms", "pack_own.forms.one", "pack_own.forms.other"]
    assert list(found) == package


def test_of_a_namespace_modules_count(folder: Path) -> None:
    assert list(sources_of(made("space_own.one", "Form"))) == ["space_own", "space_own.one", "space_own.two"]


def test_what_is_compiled_counts_with_its_bytes(folder: Path) -> None:
    source = folder / "first_own.py"
    code = folder / "first_own.pyc"
    py_compile.compile(str(source), cfile=str(code), doraise=True)
    source.unlink()
    forget()
    assert sources_of(made("first_own", "Form")) == {"first_own": code.read_bytes()}


def test_in_a_library_only_the_same_package_counts(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """There all packages lie beside each other."""
    monkeypatch.setattr(versions, "in_library", lambda file: True)
    assert list(sources_of(made("first_own", "Form"))) == ["first_own"]
