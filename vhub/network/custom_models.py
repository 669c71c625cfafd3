"""Custom link models: a package's code that decides the fate of packets, beside the vHub's stages.

A deployment names a model and its parameters; it never brings code. The code is an entry point of the group
`foosim.link_models` in a package that is installed where the vHub runs: a class, or a function, that takes the
parameters and returns an object with the method of `LinkModel`. A model is a function of what it is given: it owns no
clock, file or generator, so that a run whose vHub was started again has the same fates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, NoReturn, Protocol

from foosim.common.errors import Refused
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_quoted
from foosim.deployment.loader import Text, refuse_findings
from foosim.deployment.network.impairments import OwnModel
from foosim.deployment.network.rules import Network
from foosim.world.scene import Vector

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP: Final = "foosim.link_models"
VERSION_KEY: Final = "link model "
"""Before the name of a model in a capture's versions."""
NOT_INSTALLED: Final = "not installed"


class Wall(NamedTuple):
    """An obstacle between the two ends: its name, the length of the line inside it (m), its attenuation at the radio's
    frequency (dB)."""

    name: str
    chord_m: float
    loss_db: float


class End(NamedTuple):
    """One end of a link in the newest committed frame: its antenna's place (m) and its body's velocity (m/s), both in
    the world frame. An endpoint without a body is at rest."""

    name: str
    position_m: Vector
    velocity_m_s: Vector


class Passage(NamedTuple):
    """One packet on one link, as a model sees it."""

    source: End
    destination: End
    channel: str
    sequence: int
    """It orders the packets of a source; what else a robot sends shifts it."""
    copy: int
    """1 for a duplicate that the link makes."""
    sent_ns: int
    """In simulated time."""
    size: int
    """Of the payload, in bytes."""
    distance_m: float
    """Between the antennas."""
    walls: tuple[Wall, ...]
    """Obstacles between them, without their own bodies."""
    words: tuple[int, ...]
    """Eight 64-bit draws that are reserved for the model, by the packet's address (`draw_address`) and copy.
    `foosim.common.keyed_random` makes numbers of them."""


class Judged(NamedTuple):
    """A model's decision. `memory` is passed to it with the link's next packet.

    It is a plain value, `None`, true or false, a number, a text, or lists and dicts with texts for keys of these, and
    has at most MEMORY_BYTES_MAX bytes as msgpack. It is kept in the vHub's journal.
    """

    is_dropped: bool = False
    """It is lost, with the cause `model`."""
    extra_ns: int = 0
    """The delay that is added."""
    memory: Any = None


class LinkModel(Protocol):
    """A model as made by its entry point from the deployment's parameters. Raises ValueError for invalid ones."""

    def judge(self, passage: Passage, memory: Any) -> Judged:
        """Judge one packet, offered on a link after the one that left this memory; None before the first."""


class ModelError(Refused):
    """A link model that cannot be loaded: the key of its setting that is wrong, and why."""

    exit_code = 2

    def __init__(self, key: Literal["name", "parameters"], what: str, model: OwnModel, nearest: str | None) -> None:
        super().__init__(f"link model {model.name!r}: {what}")
        self.key: Literal["name", "parameters"] = key
        self.problem, self.nearest = what, nearest


# --- finding one ------------------------------------------------------------------------------------------------------


def installed() -> dict[str, list[EntryPoint]]:
    """Return the models that are installed here, by name; more than one where packages give the same name."""
    from importlib.metadata import entry_points  # brings the parser of e-mail

    found: dict[str, list[EntryPoint]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, giver_of(entry))):
        found.setdefault(entry.name, []).append(entry)
    return found


def giver_of(entry: EntryPoint) -> str:
    """Return the package of a model, and its version: `mylink 1.2`."""
    return "" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


def make_model(model: OwnModel) -> LinkModel:
    """Return the model that a setting names, with its parameters; raises ModelError."""
    known = installed()
    entries = known.get(model.name, [])
    if not entries:
        names = ", ".join(known) or "none"
        nearest = nearest_quoted(model.name, known)
        raise ModelError("name", f"not a link model that is installed here, there are {names}", model, nearest)
    if len(entries) > 1:
        givers = " and ".join(map(giver_of, entries))
        raise ModelError("name", f"ambiguous: a link model of {givers}", model, None)
    (entry,) = entries
    try:
        make: Any = entry.load()
    except Exception as error:  # noqa: BLE001  # raised by a user's module
        _refuse("name", f"of {giver_of(entry)}, cannot be loaded", error, model)
    try:
        made: Any = make(deepcopy(model.parameters))
    except Exception as error:  # noqa: BLE001  # raised by a user's code
        _refuse("parameters", f"not taken by link model {model.name} of {giver_of(entry)}", error, model)
    if not callable(getattr(made, "judge", None)):
        raise ModelError("name", f"of {giver_of(entry)}, makes {type(made).__name__}, without `judge`", model, None)
    judging: LinkModel = made
    return judging


def _refuse(key: Literal["name", "parameters"], what: str, error: Exception, model: OwnModel) -> NoReturn:
    raise ModelError(key, f"{what}: {type(error).__name__}: {error}", model, None) from error


# --- those of a network -----------------------------------------------------------------------------------------------


def models_of(network: Network) -> Iterator[tuple[Location, OwnModel]]:
    """Yield the link models of a network, with their places in the deployment."""
    for name, radio in network.radios.items():
        if radio.model is not None:
            yield ("network", "radios", name, "model"), radio.model
    for number, rule in enumerate(network.links):
        if rule.model is not None:
            yield ("network", "links", number, "model"), rule.model


def check_link_models(network: Network, text: Text, name: str, sets: Sequence[str] = ()) -> None:
    """Refuse link models that cannot be loaded here, each with its place in the file.

    `text`, `name` and `sets` are what the network was loaded from. Raises DeploymentError.
    """
    findings = []
    for location, model in models_of(network):
        try:
            make_model(model)
        except ModelError as error:
            value = model.name if error.key == "name" else model.parameters
            findings.append(Finding((*location, error.key), error.problem, value, error.nearest))
    refuse_findings(text, name, findings, sets)


def model_versions(network: Network) -> dict[str, str]:
    """Return the package and version of each link model of a network, as a capture's versions have them."""
    names = sorted({model.name for _, model in models_of(network)})
    known = installed() if names else {}
    return {VERSION_KEY + name: ", ".join(map(giver_of, known.get(name, ()))) or NOT_INSTALLED for name in names}


def differing_models(network: Network, versions: Mapping[str, str]) -> Iterator[str]:
    """Yield a warning for each link model of a capture whose package differs from the installed one."""
    for key, here in model_versions(network).items():
        there = versions.get(key)
        if there is not None and there != here:
            yield f"{key} is of {there} in the capture, here it is {'' if here == NOT_INSTALLED else 'of '}{here}"
