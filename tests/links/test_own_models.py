"""Link models of one's own: from a package's entry point to a packet's fate, and what is refused or fails."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.cli.net import linted
from foosim.common.errors import DeploymentError
from foosim.common.keyed_random import draw_words
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.settings_text import impairments_text
from foosim.protocol.messages import Sent
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.what_if import what_if
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.custom_models import ModelError, Passage, check_link_models, differing_models, model_versions
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.stages.custom_model import MODEL, MODEL_FAILED
from foosim.vhub.state.records import Closing
from tests.links.offered import MS, TABLE, Hub, deployment_of, every, fates, rule
from tests.links.packages import ALL, install
from tests.links.proof import Proof
from tests.links.statistics import binomial_z
from tests.simulation.conftest import replay

LATE_NS: Final = 3 * MS
FOG: Final = f"model: {{name: fog, parameters: {{lost_per_m: 0.05, every: 4, late_ns: {LATE_NS}}}}}"


@pytest.fixture
def foggy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with link models, installed in a folder."""
    folder = install(tmp_path / "site", models=ALL)
    monkeypatch.syspath_prepend(str(folder))
    yield folder
    sys.modules.pop("foggy", None)


def places(far: float) -> str:
    return f"network.places={{a: [0 m, 0 m, 5 m], b: [{far} m, 0 m, 5 m]}}"


def network(*models: str) -> str:
    """A deployment's text, with rules for a to b that have these models."""
    rules = [f"{{id: r{n}, from: a, to: b, {model}}}" for n, model in enumerate(models)]
    return apply_sets(TABLE.read_text(), "t.yaml", ["clients={a: {}, b: {}}", f"network.links=[{', '.join(rules)}]"])


# --- what a model decides --------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("foggy")
def test_it_decides_by_the_world_and_its_own_draws(proof: Proof) -> None:
    """It loses 5 % a metre, and what it remembers holds up every fourth of those that pass."""
    n = proof.size(4_000, 40_000)
    for far in (2, 8):
        fabric = Fabric(deployment_of(f"seed={proof.seed}", rule(f"delay: 1 ms, order: free, {FOG}"), places(far)))
        found = list(fates(fabric, every(10 * MS, n)))
        lost = sum(flight.cause == MODEL for flight in found)
        proof.normal("T24", f"an own model loses 5 % a metre, at {far} m", binomial_z(lost, n, 0.05 * far), n)
        passed = [flight for flight in found if not flight.cause]
        assert len(passed) + lost == n
        delays = [flight.due_ns - flight.sent_ns - MS for flight in passed]
        assert delays == [LATE_NS * (number % 4 == 0) for number in range(1, len(passed) + 1)]
        assert [flight.model_ns for flight in passed] == delays
        assert all(packet_row(flight).model_ns == flight.model_ns for flight in found)


@pytest.mark.usefixtures("foggy")
def test_other_draws_are_what_they_were() -> None:
    """A model has words of its own: switched on, or with others beside it, it changes nobody's luck."""
    plain = "loss: 10 %, jitter: {shape: gamma, sd: 1 ms}, duplicate: 10 %, order: free"
    found = [list(fates(Fabric(deployment_of(rule(text), places(4))), every(MS, 500)))
             for text in (plain, f"{plain}, {FOG}")]  # fmt: skip
    assert sum(flight.cause == MODEL for flight in found[1]) > 50
    for without, with_model in zip(*found, strict=True):
        assert without.words == with_model.words
        assert without.cause == with_model.cause or (not without.cause and with_model.cause == MODEL)
        if not with_model.cause:
            assert with_model.due_ns - with_model.model_ns == without.due_ns
            assert with_model.is_doubled == without.is_doubled
    alone = list(fates(Fabric(deployment_of(rule(FOG), places(4))), every(MS, 500)))
    luck = [(flight.cause == MODEL) for flight in alone]
    assert [one or two for one, two in zip(luck, (f.cause == "random_loss" for f in found[0]), strict=True)] == [
        bool(flight.cause) for flight in found[1]
    ]


def seen_by_probe() -> list[tuple[Passage, Any]]:
    seen: list[tuple[Passage, Any]] = sys.modules["foggy"].Probe.seen
    return seen


@pytest.mark.usefixtures("foggy")
def test_what_a_model_is_given() -> None:
    """Ends in the newest frame, what stands between them, the packet; its memory comes back as plain values."""
    wall = "{shape: box, length: 20 cm, width: 3 m, height: 3 m, x: 2 m, z: 5 m, surface: walls, radio: {loss: 7 dB}}"
    deployment = deployment_of(rule("model: {name: probe}"), places(4), f"scenery={{wall: {wall}}}")
    hub = Hub(deployment)
    hub.close({"a": [Sent(1, "b", "news", 0, bytes(33)), Sent(2, "b", "data", 0, bytes(5))]})
    hub.close({"a": [Sent(4, "b", "data", 0, b"")]})
    (first, nothing), (second, memory), (third, _) = seen_by_probe()
    assert (first.source.name, first.source.position_m, first.source.velocity_m_s) == ("a", (0, 0, 5), (0, 0, 0))
    assert (first.destination.position_m, first.distance_m) == ((4, 0, 5), 4.0)
    (between,) = first.walls
    assert (between.name, between.loss_db) == ("wall", 7.0) and between.chord_m == pytest.approx(0.2)
    assert (first.channel, first.sequence, first.copy, first.size, first.sent_ns) == ("news", 1, 0, 33, 0)
    assert (second.sequence, second.size, third.sent_ns) == (2, 5, deployment.tick_ns)
    assert nothing is None and memory == {"number": 1, "list": [1, 2.5, None, "text", True]}
    assert len(first.words) == 8 and len({*first.words, *second.words, *third.words}) == 24
    draws = hub.state.fabric.link("a", "b", "news").setup_at(0).draws
    assert set(first.words).isdisjoint(draw_words(draws.key, 1)), "those of the named slots are others'"


def test_the_example_of_the_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What docs/explanation/network.md shows, in a package as it says."""
    guide = (TABLE.parents[1] / "docs" / "explanation" / "network.md").read_text()
    (code,) = [block for block in guide.split("```python\n")[1:] if "Judged" in block]
    folder = install(tmp_path / "site")
    (folder / "foggy.py").write_text(code.partition("```")[0])
    monkeypatch.syspath_prepend(str(folder))
    model = "model: {name: fog, parameters: {lost_per_m: 0.1}}"
    found = list(fates(Fabric(deployment_of(rule(model), places(5))), every(MS, 200)))
    sys.modules.pop("foggy")
    assert {flight.cause for flight in found} == {"", MODEL}


# --- the laws --------------------------------------------------------------------------------------------------------

SETS: Final = ("engine=pure", "network.links=[{id: all, from: '*', to: '*', delay: 1 ms, "
               + FOG.replace("0.05", "0.4") + "}]", "network.places={'*': [0 m, 0 m, 1 m]}")  # fmt: skip


def rows_of_run(nodes: int, kill: bool = False, path: Path | None = None) -> tuple[list[bytes], dict[str, Any]]:
    rows: list[bytes] = []

    def keep(closing: Closing) -> None:
        for flight in closing.fates:
            rows.append(msgspec.json.encode(msgspec.structs.replace(packet_row(flight), wall_released_ns=0)))

    def prepare(system: System) -> None:
        for tick in (40, 90) if kill else ():
            system.at_tick(tick, lambda: system.kill_hub("torn", 20 * MS))

    done = rehearse(TABLE.read_text(), TABLE.name, 150, nodes, SETS, Settings(on_closing=keep), prepare=prepare,
                    capture=path)  # fmt: skip
    assert not done.json["failed"]
    return rows, done.json


@pytest.mark.usefixtures("foggy")
def test_fates_do_not_know_nodes_or_a_vhub_that_was_killed(tmp_path: Path) -> None:
    """Laws 3 and 6: what a model remembers is in the journal. What-if and explain find the same again."""
    rows, result = rows_of_run(1, path=tmp_path / "run.mcap")
    assert rows_of_run(3)[0] == rows
    assert rows_of_run(2, kill=True)[0] == rows
    capture = open_capture(tmp_path / "run.mcap")
    assert capture.about.versions["link model fog"] == "foggy 1.2"
    profiles = capture.deployment.profiles()
    assert profiles.on_radio, "fates depend on where endpoints are"
    found = what_if(capture)
    assert (found.packets, found.changed, found.inputs_changed) == (len(rows), 0, 0)
    assert 100 < found.causes[MODEL] < result["packets"]["offered"] / 2
    told = [row for row in capture.rows(PACKETS) if isinstance(row, PacketRow)]
    lost = next(row for row in told if row.cause == MODEL)
    late = next(row for row in told if row.model_ns)
    for row, outcome in ((lost, "dropped"), (late, "passed")):
        explained = explain_packet(capture, PacketName(row.source, row.sequence, row.destination))
        (step,) = [step for step in explained.steps if step.stage == "custom_model"]
        assert step.outcome == outcome and step.text.startswith("fog of foggy 1.2") and explained.agrees
    assert "link model 3 ms" in next(step.text for step in explained.steps if step.stage == "delay")


def test_a_capture_without_its_package(tmp_path: Path, foggy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another version is told; without the package nothing is judged again."""
    rows_of_run(1, path=tmp_path / "run.mcap")
    capture = open_capture(tmp_path / "run.mcap")
    assert list(differing_models(capture.deployment.network, capture.about.versions)) == []
    (foggy / "foggy-1.2.dist-info").rename(foggy / "foggy-1.3.dist-info")
    (foggy / "foggy-1.3.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: foggy\nVersion: 1.3\n")
    (line,) = differing_models(capture.deployment.network, capture.about.versions)
    assert line == "link model fog is of foggy 1.2 in the capture, here it is of foggy 1.3"
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path != str(foggy)])
    (line,) = differing_models(capture.deployment.network, capture.about.versions)
    assert line == "link model fog is of foggy 1.2 in the capture, here it is not installed"
    with pytest.raises(ModelError, match="link model 'fog': not a link model that is installed here, there are none"):
        what_if(capture)
    refused = replay("what-if", tmp_path / "run.mcap")
    assert (refused.code, refused.out) == (2, "")
    assert refused.err.startswith(f"warning: {line}\nlink model 'fog': not a")
    other = tmp_path / "other.yaml"
    other.write_text("network:\n  links:\n  - {id: all, from: '*', to: '*', model: {name: mist}}\n")
    refused = replay("what-if", tmp_path / "run.mcap", "--network", other)
    assert refused.code == 2 and refused.err.startswith(f"{other}:3:49: network.links[0].model.name: not a")
    assert replay("what-if", tmp_path / "run.mcap", "--set", "network.links.all.model=null").code == 0


def test_the_text_of_a_link_has_its_model_with_the_parameters() -> None:
    model = "model: {name: fog, parameters: {loss: many, late_ns: [1, {a: null}]}}"
    (link,) = deployment_of(rule(f"{model}, loss: 1 %, order: free")).network.links
    assert 'link model fog {"loss":"many","late_ns":[1,{"a":null}]}' in impairments_text(link)


# --- what fails -------------------------------------------------------------------------------------------------------

BROKEN: Final = {
    "raises": "KeyError: \"'nothing'\"",
    "none": "it returns NoneType, not Judged",
    "early": "extra_ns is -1, not a whole number from 0 to 60000000000",
    "never": f"extra_ns is {10**20}, not a whole number from 0 to 60000000000",
    "float": "extra_ns is nan, not a whole number from 0 to 60000000000",
    "word": "is_dropped is 'yes', not True or False",
    "set": "memory has set",
    "keys": "memory has a dict whose keys are not all texts",
    "infinite": "memory has inf",
    "huge": "memory has a whole number of more than 64 bits",
    "long": "ValueError: 'memory has 5003 bytes, at most 4096 are kept'",
    "object": "memory has Probe",
}


@pytest.mark.usefixtures("foggy")
@pytest.mark.parametrize("answer", BROKEN)
def test_a_model_that_breaks_its_word_fails_by_name(answer: str) -> None:
    """The packet is lost and says so; what the link remembered stays; the first failure is told."""
    fabric = Fabric(deployment_of(rule(f"model: {{name: probe, parameters: {{answer: {answer}}}}}"), places(4)))
    found = list(fates(fabric, every(MS, 5)))
    assert [flight.cause for flight in found] == ["", "", *[MODEL_FAILED] * 3]
    told = f"link model probe failed on packet a:3:b, sent at 0.002 s on data: {BROKEN[answer]}"
    assert fabric.faults == [told]
    assert [memory and memory["number"] for _, memory in seen_by_probe()] == [None, 1, 2, 2, 2]


@pytest.mark.usefixtures("foggy")
def test_a_run_whose_model_fails_ends_in_order(tmp_path: Path) -> None:
    """The supervisor is told why; the capture is whole and has the packet that it failed on."""
    links = "network.links=[{id: all, from: '*', to: '*', model: {name: probe, parameters: {answer: raises}}}]"
    done = rehearse(TABLE.read_text(), TABLE.name, 400, 1, ["engine=pure", links], capture=tmp_path / "run.mcap")
    assert done.json["failed"] and done.json["ticks"] < 400
    assert done.json["reason"].startswith("lost the network: link model probe failed on packet ")
    capture = open_capture(tmp_path / "run.mcap")
    assert capture.finished
    failed = [row for row in capture.rows(PACKETS) if isinstance(row, PacketRow) and row.cause == MODEL_FAILED]
    assert f"packet {failed[0].source}:{failed[0].sequence}:{failed[0].destination}" in done.json["reason"]
    explained = explain_packet(capture, PacketName(failed[0].source, failed[0].sequence, failed[0].destination))
    assert "which failed" in next(step.text for step in explained.steps if step.stage == "custom_model")


# --- what is refused --------------------------------------------------------------------------------------------------

REFUSED: Final = {
    "{name: fogg}": "name: not a link model that is installed here, there are broken, fog, lost, probe, shapeless, "
    "'fogg', nearest is 'fog'",
    "{name: lost}": "name: of foggy 1.2, cannot be loaded: ModuleNotFoundError: No module named 'gone', 'lost'",
    "{name: broken}": "name: of foggy 1.2, cannot be loaded: AttributeError: "
    "module 'foggy' has no attribute 'nothing', 'broken'",
    "{name: shapeless}": "name: of foggy 1.2, makes object, without `judge`, 'shapeless'",
    "{name: fog, parameters: {colour: grey}}": "parameters: not taken by link model fog of foggy 1.2: "
    "ValueError: unknown colour, a mapping of 1",
}


@pytest.mark.usefixtures("foggy")
@pytest.mark.parametrize("model", REFUSED)
def test_a_model_that_cannot_be_had_is_refused_at_its_place(tmp_path: Path, model: str) -> None:
    text = network("loss: 1 %", f"model: {model}")
    with pytest.raises(DeploymentError) as refused:
        check_link_models(load_deployment(text, "t.yaml").network, text, "t.yaml")
    (problem,) = refused.value.problems
    place, _, said = problem.partition(": ")
    assert said == f"network.links[1].model.{REFUSED[model]}"
    assert place.startswith("--set:2:") and all(number.isdigit() for number in place.split(":")[1:])
    alone = tmp_path / "alone.yaml"
    alone.write_text(f"network:\n  links:\n  - {{id: one, from: a, to: b, model: {model}}}\n")
    with pytest.raises(DeploymentError, match=f"{alone.name}:3:"):
        linted(alone, [])
    found, _ = linted(alone, ["network.links.one.model={name: fog}"])
    assert [meaning.name for meaning in found] == ["one with link model fog"]


def test_two_packages_that_give_one_name(tmp_path: Path, foggy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(install(tmp_path / "other", name="mist", version="3")))
    deployment = load_deployment(network("model: {name: fog}"), "t.yaml")
    with pytest.raises(DeploymentError, match=r"ambiguous: a link model of foggy 1\.2 and mist 3"):
        check_link_models(deployment.network, network("model: {name: fog}"), "t.yaml")
    assert model_versions(deployment.network) == {"link model fog": "foggy 1.2, mist 3"}


def test_a_vhub_on_another_machine_has_its_own(tmp_path: Path) -> None:
    """Where the deployment places the vHub elsewhere, nothing has to be installed here."""
    file = tmp_path / "t.yaml"
    file.write_text(network("model: {name: fog}"))
    with pytest.raises(DeploymentError, match="there are none"):
        linted(file, [])
    found, _ = linted(
        file, ["hosts={far: {address: far.example}}", "vhub={host: far}", "supervisor.process=null", "players={}"]
    )
    assert any(meaning.model == "fog" for meaning in found)


@pytest.mark.parametrize(
    ("model", "problem"),
    [
        ("foosim.evil:Model", "not a mapping"),
        ("{name: Foo.Bar}", "not a name"),
        ("{name: fog, path: /tmp}", "unknown key, 'path'"),
        ("{parameters: {a: 1}}", "missing key, 'name'"),
    ],
)
def test_a_deployment_names_a_model_and_brings_no_code(model: str, problem: str) -> None:
    with pytest.raises(DeploymentError, match=problem):
        network(f"model: {model}")
