"""The options of `up` for a page: which of them go together, and what the console is started with."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.errors import BadValue
from foosim.launcher.console_child import page_of


def test_a_page_has_a_recording_beside_it_whose_path_holds_in_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    second = Path("walk.csv")
    second.touch()
    page = page_of(True, False, second, "-1.5s", False)
    assert page == ["--second", str(tmp_path / "walk.csv"), "--offset=-1.5s"]
    assert page_of(False, True, None, None, False) == ["--open"] and page_of(True, False, None, None, False) == []
    assert page_of(False, False, None, None, True) is None


@pytest.mark.parametrize(
    ("console", "second", "offset", "detached", "said"),
    [
        (False, "x.csv", None, False, "--second is valid with --console only, 'x.csv'"),
        (False, None, "1s", False, "--offset is valid with --console only, '1s'"),
        (True, None, None, True, "--console and --detach exclude each other"),
        (True, None, "1s", False, "--offset needs --second, '1s'"),
        (True, __file__, "soon", False, "--offset: not a time"),
        (True, "absent.csv", None, False, "--second: no such file, 'absent.csv'"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    console: bool, second: str | None, offset: str | None, detached: bool, said: str
) -> None:
    with pytest.raises(BadValue) as refused:
        page_of(console, False, None if second is None else Path(second), offset, detached)
    assert str(refused.value).startswith(said)
