"""`--connect run:NAME`: a process waits for the address of its run."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.protocol.channels import Plane
from foosim.runtime.roles.shell import address_of
from foosim.runtime.run_folder import NoRun, RunFolder, RunInfo, create_run
from foosim.runtime.transport.session import ConnectError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunFolder:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return create_run("table", "mine")


def info(radio: str = "") -> RunInfo:
    return RunInfo("mine", "table", "table.yaml", 1, "", "tcp/127.0.0.1:7400", radio)


class Looks:
    """Writes the next run file at each look, and gives up after the last one."""

    def __init__(self, folder: RunFolder, *infos: RunInfo | None) -> None:
        self.folder = folder
        self.left = list(infos)

    def __call__(self) -> bool:
        if not self.left:
            return True
        content = self.left.pop(0)
        if content is not None:
            self.folder.write_info(content)
        return False


def test_an_address_is_waited_for(folder: RunFolder) -> None:
    assert address_of("mine", Plane.SIMULATION, Looks(folder, None, None, info())) == "tcp/127.0.0.1:7400"


def test_that_of_the_radio_plane_comes_later(folder: RunFolder) -> None:
    looks = Looks(folder, None, info(), info("tcp/127.0.0.1:7401"))
    assert address_of("mine", Plane.RADIO, looks) == "tcp/127.0.0.1:7401" and not looks.left


def test_a_run_that_has_ended_or_was_given_up_has_none(folder: RunFolder) -> None:
    with pytest.raises(ConnectError, match="stopped before run mine had an address"):
        address_of("mine", Plane.SIMULATION, Looks(folder, None))
    folder.write_result({"reason": "done"})
    with pytest.raises(ConnectError, match="run mine has ended"):
        address_of("mine", Plane.SIMULATION, Looks(folder, None, None))


def test_an_unknown_run_is_refused(folder: RunFolder) -> None:
    with pytest.raises(NoRun, match="no run 'mime'"):
        address_of("mime", Plane.SIMULATION, lambda: False)
