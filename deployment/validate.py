"""The checks of a deployment whose fields are each right by themselves: the table of all, and the function of each row.

They read the typed deployment. A finding's value is what is written at its location; loader.py turns findings into
lines with places. The network's are in validate_network.py.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from fnmatch import fnmatchcase
from fractions import Fraction
from itertools import chain
from math import ceil
from typing import Any, Final, NamedTuple

from pydantic import ValidationError

from foosim.common import names, units
from foosim.common.errors import ABSENT, CHOICES_MAX, BadValue, Refused, UnknownName, show
from foosim.common.finding import Finding, Location, path_text
from foosim.common.keyed_random import draw_key
from foosim.common.names import NAME_RULE, is_robot_name, nearest_name
from foosim.common.spec_base import RATE_MIN, SpecBase
from foosim.common.units import format_ns, format_rate
from foosim.deployment.components import SECTIONS
from foosim.deployment.schema import Deployment, Player
from foosim.deployment.schema_errors import settings_findings
from foosim.deployment.validate_network import Names, check_network, place_findings, rule_findings
from foosim.world.air import WindSettings
from foosim.world.assembly.sections import findings_of
from foosim.world.assembly.versions import foreign_versions
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import (
    ENGINES,
    JOINTS,
    JOINTS_MAX,
    ROBOTS,
    Carrier,
    Component,
    ComponentType,
    EntityRule,
    Kit,
    Model,
    WorldRule,
    overrides,
    with_article,
    word_of,
)
from foosim.world.component_types.failures import failure_of
from foosim.world.component_types.per_field import Numbers, numbers_of, read_per_field
from foosim.world.component_types.settings import (
    ActuatorSettings,
    ComponentSettings,
    EntitySettings,
    ModifierSettings,
    RobotSettings,
    SensorSettings,
)
from foosim.world.components.joint_names import joint_indices
from foosim.world.components.reach import REACHED
from foosim.world.components.view import IncompatibleComponent, Mounting
from foosim.world.layout import (
    WORLD,
    Declaring,
    Layout,
    build_layout,
    declaring,
    least_period_ns,
    of_motion,
    spares_of,
    trigger_slot,
)
from foosim.world.matter.materials import RadioMaterial
from foosim.world.moving.upright import stands_upright
from foosim.world.placing import MountedAt, MountedOrStanding
from foosim.world.scenery import SceneryMesh

Said = dict[tuple[str, str], dict[str, list[str]]]
"""By what a player hears, as a text, and a selector: the channels that it subscribes to, each with their endpoints."""
Labelled = EntitySettings | SensorSettings | ActuatorSettings
Find = Callable[[Deployment, Names], Iterable[Finding]]
"""Finds problems, lazily. Names are those of the endpoints."""


# --- names, processes and players -------------------------------------------------------------------------------------


def _names(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Entities, endpoints, processes that a run starts, and the channels of a robot, have names of their own."""
    entities: dict[str, str] = {}
    endpoints: dict[str, str] = {}
    processes: dict[str, str] = {}
    reserved = (WORLD, *_brought(deployment))
    for section, scopes, refused in (
        ("robots", (entities, endpoints), reserved),
        ("objects", (entities,), reserved),
        ("nodes", (processes,), names.PROCESS_NAMES_RESERVED),
        ("players", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
        ("clients", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
    ):
        for name in getattr(deployment, section):
            if name in refused:
                yield Finding((section, name), "a reserved name", at="key")
            other = next((scope[name] for scope in scopes if name in scope), None)
            if other is not None:
                yield Finding((section, name), f"a name that is also one of {other}", at="key")
            for scope in scopes:
                scope.setdefault(name, section)
    for name, robot in deployment.robots.items():
        for section, others in (("sensors", robot.actuators), ("actuators", {})):
            for channel in getattr(robot, section):
                location = ("robots", name, section, channel)
                if channel == names.CHANNEL_ECHO:
                    yield Finding(location, "a reserved name", at="key")
                elif channel in others:
                    yield Finding(location, f"a name that is also one of {name}'s actuators", at="key")


def _labels(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """A label is that of one entity, and of one component of its robot; none has it as its name."""
    sections = ("robots", deployment.robots), ("objects", deployment.objects)
    yield from _doubled_labels(
        {(section, name): its for section, entities in sections for name, its in entities.items()}
    )
    for name, robot in deployment.robots.items():
        parts = ("sensors", robot.sensors), ("actuators", robot.actuators)
        yield from _doubled_labels(
            {("robots", name, part, channel): its for part, its_own in parts for channel, its in its_own.items()}
        )


def _doubled_labels(labelled: Mapping[Location, Labelled]) -> Iterator[Finding]:
    taken = {str(location[-1]): location for location, its in labelled.items() if not its.label}
    for location, its in labelled.items():
        if its.label and (other := taken.setdefault(its.label, location)) != location:
            yield Finding((*location, "label"), f"also the label or the name of {path_text(other)}")


def _processes(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """A process that roles share has a name of its own, is in one place, and is started by `up`."""
    sections = {name: section for section in ("clients", "players", "nodes") for name in getattr(deployment, section)}
    places: dict[str, tuple[Any, Any]] = {}
    for role, about in (("supervisor",), deployment.supervisor), *_placed(deployment):
        process, location = about.process, (*role, "process")
        if process is None:
            continue
        if process in names.PROCESS_NAMES_RESERVED:
            yield Finding(location, "a reserved name")
        elif process in sections:
            yield Finding(location, f"a name that is also one of {sections[process]}")
        place = getattr(about, "host", None), getattr(about, "label", None)
        if places.setdefault(process, place) != place:
            yield Finding(location, "a process whose roles are not all on the same host")
        launch = getattr(about, "launch", "local")
        if launch != "local":
            yield Finding(location, f"a process for a {role[0][:-1]} with `launch: {launch}`, which has its own")
        is_apart = process == deployment.supervisor.process != deployment.vhub.process
        if role[0] == "players" and is_apart:  # it would start before it is known where to connect
            yield Finding(location, "a player shares the supervisor's process only together with the vHub")


def _placed(deployment: Deployment) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the roles whose processes are placed on hosts, by location."""
    yield ("vhub",), deployment.vhub
    for section in ("nodes", "players"):
        yield from (((section, name), about) for name, about in getattr(deployment, section).items())


def _hosts(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Processes are placed on hosts that exist, by name or by label; a unit of systemd needs such a place."""
    hosts = deployment.hosts
    labels = {label for host in hosts.values() for label in host.labels}
    for role, about in _placed(deployment):
        if about.host is not None and about.host not in hosts:
            yield Finding((*role, "host"), "unknown host", nearest=ends.nearest(about.host, hosts))
        if about.label is not None and about.host is not None:
            yield Finding((*role, "label"), "label beside host: only one of them is valid")
        elif about.label is not None and about.label not in labels:
            yield Finding((*role, "label"), "a label that no host has", nearest=ends.nearest(about.label, labels))
        if about.host is None and about.label is None and getattr(about, "launch", "") == "systemd":
            yield Finding((*role, "launch"), "a unit of systemd needs a host or a label")


def _nodes(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Every robot has exactly one owner."""
    owner: dict[str, str] = {}
    for node, about in deployment.nodes.items():
        for index, robot in enumerate(about.robots):
            location = ("nodes", node, "robots", index)
            if robot not in deployment.robots:
                yield Finding(location, "unknown robot", robot, ends.nearest(robot, deployment.robots))
            elif robot in owner:
                other = owner[robot]
                what = "listed twice" if other == node else f"a robot with two owners, also of node {other}"
                yield Finding(location, what, robot)
            owner.setdefault(robot, node)
    for robot in deployment.robots:
        if robot not in owner:
            yield Finding(("robots", robot), "a robot that no node owns", at="key")


def _players(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Players name robots that exist, and channels that those have."""
    for player, about in deployment.players.items():
        for robot, chosen in about.robots.items():
            location: Location = ("players", player, "robots", robot)
            if robot not in deployment.robots:
                yield Finding(location, "unknown robot", nearest=ends.nearest(robot, deployment.robots), at="key")
                continue
            channels = [*deployment.robots[robot].sensors, names.CHANNEL_ECHO]
            for index, channel in enumerate(chosen):
                if channel not in channels:
                    nearest = ends.nearest(channel, channels)
                    yield Finding((*location, index), f"{robot} has no such channel", nearest=nearest)
                elif channel in chosen[:index]:
                    yield Finding((*location, index), "a channel that is listed twice")


def _hears(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """A player's `hears`: selectors that match another endpoint, channels that one of these has."""
    robots = deployment.robots
    channels_of: dict[str, set[str]] = {}
    for player, about in deployment.players.items():
        for glob, channels in about.hears.items():
            location: Location = ("players", player, "hears", glob)
            matched = ends.matched(glob)
            if all(name == player for name in matched):
                nearest = ends.nearest(glob, [name for name in ends.names if name != player])
                yield Finding(location, "a selector that matches no other endpoint", nearest=nearest, at="key")
                continue
            if glob not in channels_of:
                channels_of[glob] = {channel for name in matched if name in robots for channel in robots[name].sensors}
            if any(name not in robots and name != player for name in matched):
                continue
            valid = {*channels_of[glob], names.CHANNEL_ECHO}
            for index, channel in enumerate(channels):
                if channel not in valid:
                    nearest = ends.nearest(channel, valid)
                    yield Finding((*location, index), f"{glob} has no such channel", nearest=nearest)


def _settings(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Settings that depend on one another: of players and clients on board, people, the capture, deadlines."""
    for section in ("players", "clients"):
        for name, about in getattr(deployment, section).items():
            if about.on is not None and about.on not in deployment.robots:
                nearest = ends.nearest(about.on, deployment.robots)
                yield Finding((section, name, "on"), "unknown robot", nearest=nearest)
    consoles = [name for name, client in deployment.clients.items() if client.console]
    for name in consoles[1:]:
        yield Finding(("clients", name, "console"), f"a second one: {consoles[0]} is the console's")
    for name in consoles:
        client = deployment.clients[name]
        if client.lockstep:
            yield Finding(("clients", name, "lockstep"), "the console is not in lockstep: the run would wait for it")
        if client.on is not None:
            yield Finding(("clients", name, "on"), "the console is on board of no robot")
    for index, name in enumerate(deployment.access.viewers):  # both would receive each other's answers
        if name in deployment.access.operators:
            yield Finding(("access", "viewers", index), "a viewer that is an operator, too")
    if deployment.capture.last_ns is not None and not deployment.capture.is_split:
        yield Finding(("capture", "last"), "whole files are let go: needs split_size or split_time")
    deadlines = deployment.deadlines
    is_written = deadlines.model_fields_set >= {"tick_named_ns", "tick_lost_ns"}
    if is_written and deadlines.tick_named_ns > deadlines.tick_lost_ns:
        yield Finding(("deadlines", "tick_named"), "longer than tick_lost")


def _gateways(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Gateways serve what there is, in ways that their kinds know."""
    if all(robot in deployment.robots for gateway in deployment.gateways.values() for robot in gateway.robots):
        for name, gateway in deployment.gateways.items():
            yield from gateway.component_type.factory.check(name, gateway, deployment)


# --- times ------------------------------------------------------------------------------------------------------------


def _times(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Sensors have any rate up to that of the ticks, rates and offsets of lockstep clients are whole ticks, offsets
    are below their periods, and the clocks of radios are less than a tick apart.
    """
    tick_ns, substeps = deployment.tick_ns, deployment.substeps
    if tick_ns % substeps:
        valid = sorted((n for n in range(1, 65) if tick_ns % n == 0), key=lambda n: (abs(n - substeps), n))
        nearest = " and ".join(str(n) for n in sorted(valid[:2]))
        yield Finding(("substeps",), f"does not divide the tick of {tick_ns} ns", nearest=nearest)
    yield from _acting(deployment)
    known: Said = {}
    for name, player in deployment.players.items():
        yield from _arrivals(deployment, ends, ("players", name), player, known)
    seen: set[int] = set()
    for robot, settings in deployment.robots.items():
        for channel, sensor in settings.sensors.items():
            if id(sensor) not in seen:  # robots of a template share its sensors
                seen.add(id(sensor))
                yield from _sensor(sensor, ("robots", robot, "sensors", channel), tick_ns)
    if "poses_hz" in deployment.capture.model_fields_set:
        yield from _turns(deployment.capture.poses_hz, 0, ("capture",), tick_ns, "poses")
    if deployment.network.defaults.phase_ns > tick_ns:
        nearest = repr(format_ns(tick_ns))
        yield Finding(("network", "defaults", "phase"), "more than the tick", nearest=nearest)


def _acting(deployment: Deployment) -> Iterator[Finding]:
    """A lockstep client has a rate; a free-running one has no ticks of its own, and so no offset."""
    for section in ("players", "clients"):
        for name, about in getattr(deployment, section).items():
            if not about.lockstep:
                if "offset_ns" in about.model_fields_set:
                    what = "offset without lockstep: a free-running client has no ticks of its own"
                    yield Finding((section, name, "offset"), what, at="key")
            elif about.rate_hz is None:
                yield Finding((section, name, "rate"), "missing key of a client in lockstep", at="missing")
            else:
                yield from _turns(about.rate_hz, about.offset_ns, (section, name), deployment.tick_ns)


def _sensor(sensor: SensorSettings, place: Location, tick_ns: int) -> Iterator[Finding]:
    """A sensor has at most a reading at each tick, and its offset is below its period."""
    fastest, period_ns = Fraction(units.NS_PER_S, tick_ns), units.NS_PER_S / sensor.rate_hz
    if sensor.rate_hz > fastest:
        what = f"above the rate of the ticks: valid are {RATE_MIN} to {format_rate(fastest)}"
        yield Finding((*place, "rate"), what, nearest=repr(format_rate(fastest)))
    elif sensor.offset_ns >= period_ns:
        period = format_ns(int(period_ns)) if period_ns.denominator == 1 else f"{1 / sensor.rate_hz} s"
        valid = f"valid are {format_ns(0)} to {format_ns(ceil(period_ns) - 1)}"
        yield Finding((*place, "offset"), f"not below the period of {period}: {valid}")


def _turns(rate_hz: Fraction, offset_ns: int, place: Location, tick_ns: int, key: str = "rate") -> Iterator[Finding]:
    """A period is whole ticks; so is an offset, which is below the period."""
    try:
        period_ns = units.period_ticks(rate_hz, tick_ns) * tick_ns
    except BadValue as bad:
        yield Finding((*place, key), bad.problem, nearest=bad.nearest)
        return
    if offset_ns >= period_ns:
        valid = f"{format_ns(0)} to {format_ns(period_ns - tick_ns)} in steps of {format_ns(tick_ns)}"
        yield Finding((*place, "offset"), f"not below the period of {format_ns(period_ns)}: valid are {valid}")
    elif offset_ns % tick_ns:
        below = offset_ns - offset_ns % tick_ns
        nearest = " and ".join(repr(format_ns(at)) for at in (below, below + tick_ns) if at < period_ns)
        yield Finding((*place, "offset"), f"not a whole number of ticks of {format_ns(tick_ns)}", nearest=nearest)


def _arrivals(deployment: Deployment, ends: Names, at: Location, player: Player, known: Said) -> Iterator[Finding]:
    """A client that acts at arrival is in lockstep, has no ticks of its own, and subscribes to its `arrivals`.

    `known` keeps what is found out about the selectors.
    """
    arrivals, hears = player.arrivals, player.hears
    if player.act != "arrival":
        if arrivals:
            what = "arrivals of a player that acts by its period: needs act: arrival"
            yield Finding((*at, "arrivals"), what, at="key")
        return
    if not player.lockstep:
        what = "needs lockstep: a free-running player acts by its own clock"
        yield Finding((*at, "act"), what, nearest="'period'")
    elif "offset_ns" in player.model_fields_set:
        what = "an offset of a player that acts at arrival, and so at no ticks of its own"
        yield Finding((*at, "offset"), what, at="key")
    if not arrivals:
        yield Finding((*at, "arrivals"), "missing key of a player that acts at arrival", at="missing")
    for glob, channels in arrivals.items():
        key = str(hears), glob
        sources_of = known.get(key)
        if sources_of is None:  # players of one template hear the same
            sources_of = known[key] = _sources_of(deployment, ends, hears, glob)
        heard = {name for robot, own in player.robots.items() if fnmatchcase(robot, glob) for name in own}
        heard |= {channel for channel, sources in sources_of.items() if any(source != at[-1] for source in sources)}
        if not heard:
            others = (name for each in hears for name in ends.matched(each) if name != at[-1])
            nearest = ends.nearest(glob, chain(player.robots, others))
            what = "a selector that matches nothing it hears"
            yield Finding((*at, "arrivals", glob), what, nearest=nearest, at="key")
            continue
        for index, channel in enumerate(channels):
            if channel not in heard:
                what = f"no channel that it hears of {glob}: valid are {', '.join(sorted(heard))}"
                yield Finding((*at, "arrivals", glob, index), what)


def _sources_of(
    deployment: Deployment, ends: Names, hears: Mapping[str, Sequence[str]], glob: str
) -> dict[str, list[str]]:
    """Return the channels that `hears` takes of the endpoints of a selector, each with up to two of these."""
    found: dict[str, list[str]] = {}
    matched = {*ends.matched(glob)}
    for selector, channels in hears.items():
        for source in ends.matched(selector) if channels else ():
            if source not in matched:
                continue
            robot = deployment.robots.get(source)
            own = channels if robot is None else (*robot.sensors, names.CHANNEL_ECHO)
            for channel in channels:
                if channel in own and len(sources := found.setdefault(channel, [])) < 2 and source not in sources:
                    sources.append(source)
    return {channel: sources for channel, sources in found.items() if sources}


# --- kits and scenery -------------------------------------------------------------------------------------------------


def _kits(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Settings of a kit fit each other; its entities and rules are valid, and have unique names."""
    kits = deployment.kit_types
    taken: dict[str, str] = {}
    for key, kit in kits.items():
        problems: list[str] = []
        try:
            yield from _called(kit, "check", _checked, kit, deployment)
            spares = _spares(deployment, kit)
        except BadValue as error:
            problems, spares = [error.problem], {}
        for name, model in {**kit.entities, **spares}.items():
            problems += [f"its entity {name} {what}" for what in _not_there(model, kits)]
            if name == WORLD:
                problems.append(f"its entity {name} has a reserved name")
            if taken.setdefault(f"entity {name}", key) != key:
                problems.append(f"its entity {name} has a name that is also one of the kit {taken[f'entity {name}']}'s")
        for label, data in kit.rules.items():
            problems += [f"its rule {label}: {what}" for what in _wrong_rule(data, kits)]
            if taken.setdefault(f"rule {label}", key) != key:
                problems.append(f"its rule {label} has a name that is also one of the kit {taken[f'rule {label}']}'s")
        yield from (Finding((key,), f"kit {key}: {problem}", at="key") for problem in problems)
    for label in deployment.rules:
        if f"rule {label}" in taken:
            other = taken[f"rule {label}"]
            what = f"a rule that the kit {other} has already: each world with a {other} has it"
            yield Finding(("rules", label), what, at="key")


def _checked(kit: Kit, deployment: Deployment) -> list[Finding]:
    """Return the kit's own findings about its section."""
    made: Any = kit.factory
    return [*made.check(deployment.kits[kit.name], deployment)]


def _called(found: ComponentType, what: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a function of a component type returns. Raises BadValue, also where one of other packages fails."""
    try:
        return function(*arguments)
    except (BadValue, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, too: a function may do anything
        if found.is_own:
            raise
        raise BadValue(f"{what} fails: {failure_of(error, found.module)}") from error


def _spares(deployment: Deployment, kit: Kit) -> dict[str, str]:
    """Return the spares of a kit, models by name. Raises BadValue."""
    found: dict[str, str] = _called(kit, "spares", lambda: dict(spares_of(deployment, kit)))
    wrong = [name for name in found if not is_robot_name(name)]
    if wrong:
        raise BadValue(f"spares returns the entity {show(wrong[0])}: {NAME_RULE}")
    return found


def _brought(deployment: Deployment) -> dict[str, str]:
    """Return what kits put into the world, models by name; without the spares of those whose spares are wrong."""
    found: dict[str, str] = {}
    for kit in deployment.kit_types.values():
        found |= kit.entities
        with suppress(BadValue):
            found |= _spares(deployment, kit)
    return found


def _not_there(name: str, kits: Collection[str]) -> Iterator[str]:
    """Yield why an entity without an owner cannot be of a model."""
    try:
        model = registry.find_model(name)
    except BadValue as error:
        yield f"is of an unknown model: {error}"
        return
    if model.is_robot:
        yield f"is of the model {model.name}, which is one of robots: these have owners, and are in robots:"
    for problem in _needs_kit(model, kits, model.name):
        yield f"is of a model that cannot be there: {problem}"
    yield from (f"is {problem}" for problem in _model_problems(model))


def _wrong_rule(data: Mapping[str, Any], kits: Collection[str]) -> Iterator[str]:
    """Yield the errors of a kit's rule, given as plain data."""
    try:
        rule = registry.find("rule", data["kind"])
        rule.settings.model_validate(dict(data))
    except BadValue as error:
        yield str(error)
    except ValidationError as error:
        yield from (finding.text for finding in settings_findings(error, rule.settings, ()))
    else:
        assert isinstance(rule, WorldRule), rule
        yield from (*_needs_kit(rule, kits), *_rule_problems(rule))


def _scenery(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Some engines have no meshes, only free bodies feel surfaces; waves cross a material, or have a loss."""
    has_rigid = any(model.can_be_free for model in _models(deployment))
    for name, thing in deployment.scenery.items():
        for owner, things in (("a robot's", deployment.robots), ("an object's", deployment.objects)):
            if name in things:
                yield Finding(("scenery", name), f"a name that is also {owner}", at="key")
        if not has_rigid:
            if "surface" in thing.model_fields_set:
                yield Finding(("scenery", name, "surface"), "a surface for free bodies, in a world without any")
        elif not deployment.engine_type.meshes and isinstance(thing, SceneryMesh):
            valid = "boxes and cylinders it has; bullet and mujoco have all"
            what = f"the engine {deployment.engine} has no meshes ({valid})"
            yield Finding(("scenery", name, "shape"), what, nearest="'box'")
        if thing.radio is not None:
            yield from _radio(thing.radio, ("scenery", name, "radio"))


def _models(deployment: Deployment) -> Iterator[Model]:
    """Yield the models of robots and objects, and of the kits' entities."""
    yield from (one.component_type for one in (*deployment.robots.values(), *deployment.objects.values()))
    for name in _brought(deployment).values():
        with suppress(Refused):  # reported with the kit
            yield registry.find_model(name)


def _radio(radio: RadioMaterial, location: Location) -> Iterator[Finding]:
    """Waves cross a material, or have a fixed loss: exactly one is given."""
    if radio.is_ is None and radio.loss_db is None:
        yield Finding((*location, "is"), "missing key of a material, unless it has a loss", at="missing")
    for key, value in (("is", radio.is_), ("thickness", radio.thickness_m)):
        if value is not None and radio.loss_db is not None:
            yield Finding((*location, key), "no effect beside loss, which holds for any material", at="key")


def _open_meshes(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield open meshes of a material without a thickness."""
    for thing in deployment.open_meshes():
        radio = deployment.scenery[thing].radio
        material = "concrete" if radio is None or radio.is_ is None else radio.is_
        what = f"a wall without a thickness: the mesh is not closed, write {{is: {material}, thickness: 10 cm}}"
        yield Finding(("scenery", thing, "radio"), what, material)


# --- what models and components need ----------------------------------------------------------------------------------


def needs(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """The needs of models, components and rules are met by the world and their robot.

    Robots whose state follows from missing files are passed over. What many robots share, by a template, is checked
    once.
    """
    kits = deployment.kits
    tagged: list[Any] = [*deployment.robots.values(), *deployment.objects.values(), *_models(deployment)]
    tags = {tag for entity in tagged for tag in entity.tags}
    met: set[tuple[int, int]] = set()
    for section, entities in (("robots", deployment.robots), ("objects", deployment.objects)):
        for name, entity in entities.items():
            model, place = entity.component_type, (section, name)
            try:
                is_known = model.declared is not None or not deployment.lacks_files
                having = model.fields_of(entity, deployment) if is_known else None
            except BadValue as bad:
                value = entity.model if bad.value is ABSENT else bad.value
                path = bad.path if isinstance(bad, IncompatibleComponent) else ("model",)
                yield Finding((*place, *path), bad.problem, value, bad.nearest)
                continue
            for what in (*_needs_kit(model, kits, with_article(section[:-1])), *_model_problems(model)):
                yield Finding((*place, "model"), what, entity.model)
            for of, label, settings in _components_of(entity):
                key = (id(model) if model.declared is not None else id(entity)), id(settings)
                if key not in met:
                    met.add(key)
                    found = settings.component_type
                    for what in [*_needs_kit(found, kits)] or _component_problems(found, model, having):
                        yield Finding((*place, of, label, "kind"), what, settings.kind)
                    yield from _unknown_tags(settings, (*place, of, label), tags)
    for label, rule in deployment.rules.items():
        for what in (*_needs_kit(rule.component_type, kits), *_rule_problems(rule.component_type)):
            yield Finding(("rules", label, "kind"), what, rule.kind)
        yield from _unknown_tags(rule, ("rules", label), tags)
    if deployment.scene is not None:
        for what in _needs_kit(deployment.scene.component_type, kits):
            yield Finding(("scene", "kind"), what, deployment.scene.kind)


def _unknown_tags(settings: SpecBase | list[Any], place: Location, tags: Collection[str]) -> Iterator[Finding]:
    """Yield the settings `tag` of a component or rule, also in lists of it, with a tag of no entity."""
    for key, value in settings if isinstance(settings, SpecBase) else enumerate(settings):
        if isinstance(value, SpecBase | list):
            yield from _unknown_tags(value, (*place, key), tags)
        elif key == "tag" and value is not None and value not in tags:
            error = UnknownName("a tag that no entity has", value, sorted(tags))
            yield Finding((*place, key), error.problem, value, error.nearest)


def _components_of(entity: EntitySettings) -> Iterator[tuple[str, str, ComponentSettings]]:
    """Yield the components and rules of a robot: section, name and settings of each."""
    for section in SECTIONS if isinstance(entity, RobotSettings) else ():
        yield from ((section, name, settings) for name, settings in getattr(entity, section).items())


def _needs_kit(component_type: ComponentType, kits: Collection[str], noun: str = "") -> Iterator[str]:
    """Yield that the world is without the kit that a component type belongs to."""
    if component_type.kit and component_type.kit not in kits:
        noun = noun or word_of(component_type.type_name)
        yield f"{noun} of {with_article(component_type.kit)} in a world without one"


def _model_problems(model: Model) -> Iterator[str]:
    """Yield why entities of a model would not be solved."""
    if model.is_rigid and not model.couples and model.name not in REACHED:
        yield f"a rigid model with couples=False, which is valid of {', '.join(REACHED)} alone"


def _component_problems(component_type: ComponentType, model: Model, has: Mapping[str, int] | None) -> Iterator[str]:
    """Yield the needs of a component or rule that a robot of a model does not meet.

    `has` are the fields of its state; where they are not known nothing is missing.
    """
    word = word_of(component_type.type_name)
    needs: tuple[str, ...] = component_type.needs if isinstance(component_type, Component | EntityRule) else ()
    if isinstance(component_type, Component) and (field := _trigger_of_model(component_type)) and field not in needs:
        needs = (*needs, field)
    missing = [] if has is None else [field for field in needs if field not in has and field not in model.on_demand]
    if model.declared is None and not {*JOINTS}.isdisjoint(missing):
        yield f"{word} of joints on a robot without a joint that moves"
    elif missing:
        fitting = ", ".join(_having(needs))
        valid = f"valid on: {fitting or 'none'}" + ("" if fitting else f"; {_fields_of(model, missing, has)}")
        yield f"{word} that {with_article(model.name)} cannot carry, for lack of {', '.join(missing)} ({valid})"
    if isinstance(component_type, Component) and component_type.jobs and not model.is_solved:
        yield f"{word} whose jobs would never end: {with_article(model.name)} is neither rigid nor has a motion"
    if not isinstance(component_type, EntityRule):
        return
    written = [] if has is None else [field for field in component_type.writes if field not in has]
    if written:
        yield f"{word} that writes {', '.join(written)}: {_fields_of(model, written, has)}"
    if not model.is_solved:
        yield f"{word} that would never apply: {with_article(model.name)} is neither rigid nor has a motion"


def _having(fields: Collection[str]) -> Iterator[str]:
    """Yield the names of the models of robots whose state has these fields, and of their variants that alone do."""
    for model in models_of(robots=True):
        if {*fields} <= {*(model.declared or ()), *model.on_demand}:
            yield model.name
            continue
        for dynamics, variant in model.variants.items():
            if {*fields} <= {*(variant.declared or ())}:
                yield f"{model.name} with dynamics: {dynamics}"


def models_of(*, robots: bool) -> list[Model]:
    """Return the models of robots, or of objects, that are installed here, in name order."""
    found = map(registry.find_model, registry.names("model"))
    return [model for model in found if model.is_robot == robots]


def _trigger_of_model(sensor: Component) -> str:
    """Return the field of the model that is the trigger of a sensor; empty where that is a slot of its own, or of a
    rule or an actuator (`_unheard`)."""
    trigger = sensor.trigger
    if callable(trigger) or trigger in sensor.slots or "." in trigger:
        return ""
    return trigger


def _fields_of(model: Model, missing: Sequence[str], having: Mapping[str, int] | None) -> str:
    """Return the fields of a model, and the nearest to the first missing one."""
    fields = [*(having or ())]
    shown = ", ".join(fields[:CHOICES_MAX]) + (", ..." if len(fields) > CHOICES_MAX else "")
    nearest = nearest_name(missing[0], fields)
    near = "" if nearest is None else f", nearest to {missing[0]} is {nearest}"
    return f"{with_article(model.name)} has {shown or 'no fields'}{near}"


def _rule_problems(rule: WorldRule) -> Iterator[str]:
    """Yield the models that a rule of worlds names, and that there are not."""
    for word, models in (("remembers something of each", rule.each), ("writes", rule.writes)):
        for model in models:
            if (model != ROBOTS or word == "writes") and (":" in model or registry.lookup("model", model) is None):
                error = UnknownName("unknown model", model, registry.names("model"))
                yield f"{word_of('rule')} that {word} {model}: {error}"


# --- the settings of components ---------------------------------------------------------------------------------------


def _components(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield sensors and actuators whose slots or modifiers do not fit their settings.

    What many robots share, by a template, is checked once.
    """
    met: set[tuple[int, int]] = set()
    for name, robot in deployment.robots.items():
        model = robot.component_type
        for section in ("sensors", "actuators"):
            for channel, settings in getattr(robot, section).items():
                if (id(model), id(settings)) not in met:
                    met.add((id(model), id(settings)))
                    yield from _unfit_component(settings, model, deployment, ("robots", name, section, channel))


def _unfit_component(
    settings: SensorSettings | ActuatorSettings, model: Model, deployment: Deployment, location: Location
) -> Iterator[Finding]:
    """Yield why the slots of a sensor or actuator do not follow from its settings, and the settings of modifiers that
    do not fit the readings or commands that these are on."""
    component, period_ns = settings.component_type, deployment.tick_ns
    if isinstance(settings, SensorSettings):
        period_ns = least_period_ns(deployment, component, settings)
    # Joints are as many as may be where that follows from a robot's file.
    counts = dict.fromkeys(JOINTS, JOINTS_MAX) if model.declared is None else model.declared
    try:
        component.slots_on(settings, Carrier(0, period_ns, counts.get(JOINTS[0], 0)))
    except BadValue as error:
        yield Finding(location, error.problem, _value_of(error, settings.kind), error.nearest)
    numbers = numbers_of(component, settings, counts)
    for number, modifier in enumerate(settings.modifiers):
        place: Location = (*location, "modifiers", number)
        if numbers is None:
            what = f"a modifier changes numbers alone, and this has others: {component.type_name} {component.name}"
            yield Finding((*place, "kind"), what, modifier.kind)
        else:
            yield from _unfit_modifier(modifier, Carrier(numbers.size, period_ns), numbers, place)


def _unfit_modifier(
    settings: ModifierSettings, carrier: Carrier, numbers: Numbers, place: Location
) -> Iterator[Finding]:
    """Yield the errors of a modifier on these numbers."""
    component: Component = settings.component_type
    keys = {field.alias or name: name for name, field in component.settings.model_fields.items()}
    findings = []
    for key, least in component.per_field.items():
        written = getattr(settings, keys[key])
        parts = (
            {(key, name): {name: one} for name, one in written.items()}
            if isinstance(written, dict)
            else {(key,): written}
        )
        for path, part in parts.items():
            try:
                if part is not None:
                    read_per_field(part, numbers, least)
            except BadValue as error:
                findings.append(Finding((*place, *path), error.problem, error.value, error.nearest))
    yield from findings
    if findings:
        return
    try:
        made: Any = component.factory
        _called(component, "its check", made.check, settings, numbers)
        component.slots_on(settings, carrier)
    except BadValue as error:
        yield Finding(place, error.problem, _value_of(error, settings.kind), error.nearest)


def _value_of(error: BadValue, kind: str) -> object:
    """Return the value of an error, or the kind of its component where it has none."""
    return kind if error.value is ABSENT else error.value


# --- the state of a world ---------------------------------------------------------------------------------------------


def _doubled_slots(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield what declares a slot of an entity that something else has declared: it would be in one place for both."""
    of_rules: list[tuple[str, Declaring]] = []
    for label, settings in spec.world_rules.items():
        kits = tuple(kit.name for kit in spec.kit_types.values() if label in kit.rules)
        place: Location = ("rules", label) if label in spec.rules else kits
        for model, slots in settings.component_type.each.items():
            named = {f"{label}.{slot}": count for slot, count in slots.items()}
            of_rules.append((model, Declaring(f"rule {label} of the world", place, named)))
    seen: set[tuple[int, tuple[tuple[str, int], ...]]] = set()
    for name, robot in spec.robots.items():
        parts = (*robot.actuators.items(), *robot.rules.items(), *robot.sensors.items())
        alike = id(robot.component_type), tuple([(label, id(settings)) for label, settings in parts])
        if alike not in seen:  # many robots of a fleet are
            seen.add(alike)
            remembered = [one for model, one in of_rules if model in (robot.component_type.name, ROBOTS)]
            yield from _doubles([*remembered, *declaring(spec, name, robot)], name)
    for kit in spec.kit_types.values():
        for name, model in kit.entities.items():
            kind = registry.find_model(model)
            motion = Declaring("motion", (kit.name,), of_motion(kind))
            yield from _doubles([motion, *(one for its, one in of_rules if its == kind.name)], name)


def _doubles(all_of_it: Iterable[Declaring], entity: str) -> Iterator[Finding]:
    first: dict[str, Declaring] = {}
    for one in all_of_it:
        for slot in one.slots:
            other = first.setdefault(slot, one)
            if other is not one:
                what = f"the {one.what} declares the slot {slot} of {entity}, which the {other.what} has already"
                yield Finding(one.location, what, slot.partition(".")[2], at="key")


def _lasting_spares(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield the invalid spares: only a solved entity with its own place can be added and removed."""
    named: dict[str, Location] = {name: ("objects", name, "spare") for name, one in spec.objects.items() if one.spare}
    named |= {name: ("robots", name, "spare") for name, one in spec.robots.items() if one.spare}
    named |= {name: (kit.name,) for kit in spec.kit_types.values() for name in spares_of(spec, kit)}
    layout = build_layout(spec) if named else None
    for name, location in named.items():
        assert layout is not None
        if not layout[name].can_leave:
            what = f"a spare that could not be absent: {with_article(layout[name].model)} without a place of its own"
            if len(location) > 1:
                yield Finding(location, what)
            else:
                yield Finding(location, f"kit {location[0]}: {name}, {what}", at="key")


def _unheard(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield the sensors whose trigger is a slot that their robot does not have."""
    layout: Layout | None = None
    for name, robot in spec.robots.items():
        for channel, settings in robot.sensors.items():
            sensor = settings.component_type
            trigger = sensor.trigger_by(settings)
            if not trigger or (callable(sensor.trigger) and overrides(sensor.factory, "check")):
                continue  # its own check names the setting
            layout = layout or build_layout(spec)
            if trigger_slot(layout[name], channel, trigger) not in layout[name].offsets:
                valid = "a slot of its own, a field of the model, or RULE.SLOT of a rule of the robot"
                what = f"sensor whose trigger is {trigger}, which {name} does not have: it is {valid}"
                yield Finding(("robots", name, "sensors", channel, "kind"), what, settings.kind)


def _trial(deployment: Deployment, ends: Names) -> Iterable[Finding]:
    """Yield the findings of a trial of components from other packages; foosim's own are not tried."""
    if not foreign_versions(deployment):
        return ()
    from foosim.world.assembly.trial import trial_findings  # brings numpy

    return trial_findings(deployment)


def _start(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """What starts in something: robots that move by kinematics and are no kit's, and rigid bodies; and events."""
    if any(map(stands_upright, deployment.robots.values())):
        from foosim.world.clearance.start import start_findings  # brings numpy

        yield from start_findings(deployment)
    if next(rigid_bodies(deployment), None) is not None:
        from foosim.world.clearance.overlaps import overlap_findings  # brings numpy

        yield from overlap_findings(deployment)
    if deployment.events:
        from foosim.world.setting.scheduled import event_findings  # brings numpy

        yield from event_findings(deployment)


def _unfit_components(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield components whose settings do not fit their robots or the world: an unknown joint or link, for one."""
    checked = [
        (name, section, channel, settings)
        for name, robot in spec.robots.items()
        for section, channel, settings in _components_of(robot)
        if overrides(settings.component_type.factory, "check") or _selects(settings) or _mounting(settings)
    ]
    layout = build_layout(spec) if checked else None
    for name, section, channel, settings in checked:
        assert layout is not None
        component_type = settings.component_type
        key = draw_key(spec.seed, component_type.type_name, name, channel)
        at = Mounting(spec, layout, layout[name], channel, key, is_owners=section == "sensors")
        try:
            if _selects(settings):
                _check_joints(component_type, settings, at)
            if where := _mounting(settings):
                _check_mount(where, at)
            if overrides(component_type.factory, "check"):
                component_type.factory.check(settings, at)
        except IncompatibleComponent as error:
            place: Location = ("robots", name, section, channel, *error.path)
            yield Finding(place, error.problem, error.value, error.nearest)


def _selects(settings: ComponentSettings) -> bool:
    """Whether a component has a setting that selects joints of its robot."""
    return bool(getattr(settings.component_type, "joints", ""))


def _mounting(settings: ComponentSettings) -> MountedAt | None:
    """Return where a component is mounted; None of one without a place on its robot, and of one that checks it."""
    where = getattr(settings, "at", None)
    return where if isinstance(where, MountedAt) and not isinstance(where, MountedOrStanding) else None


def _check_mount(where: MountedAt, at: Mounting) -> None:
    """Raise IncompatibleComponent for a robot without a body, or a link that it does not have."""
    from foosim.world.components.mounted import body_at, link_index  # brings numpy

    link_index(body_at(at), where.link)


def _check_joints(component: Component, settings: ComponentSettings, at: Mounting) -> None:
    """Raise IncompatibleComponent for a setting that selects no joints of a robot."""
    from foosim.world.components.mounted import body_at  # brings numpy

    try:
        named = component.joints_named(settings)
    except BadValue as error:
        raise IncompatibleComponent((component.joints,), error.problem, error.value) from None
    joint_indices(body_at(at), named, component.joints, has_motors=component.type_name == "actuator")


def _competing(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Yield the actuators that command motors which another one of their robot commands already."""
    for name, robot in spec.robots.items():
        before: dict[str, Sequence[str] | None] = {}
        for channel, settings in robot.actuators.items():
            component = settings.component_type
            if not component.moves:
                continue
            named = component.joints_named(settings)
            for other, theirs in before.items():
                location: Location = ("robots", name, "actuators", channel)
                joint = next((one for one in named or () if theirs is None or one in theirs), None)
                if joint is not None:
                    yield Finding((*location, component.joints), f"a joint that {other} commands already", joint)
                    break
                if named is None:
                    yield Finding((*location, "kind"), f"commands all motors, of which {other} commands some already")
                    break
            before[channel] = named


# --- engines ----------------------------------------------------------------------------------------------------------


class _Rigid(NamedTuple):
    """The locations of rigid entities, and their descriptions."""

    location: tuple[str, ...]
    what: str


def _engine(spec: Deployment, ends: Names) -> Iterator[Finding]:
    """Rigid bodies that the engine does not have, those of which no engine has both, and wind that it does not have."""
    engine = spec.engine_type
    winds = [name for name, settings in spec.rules.items() if isinstance(settings, WindSettings)]
    if winds and not engine.islands:
        what = f"engine {engine.name!r} has no air; rules.{winds[0]} is wind: set engine: mujoco"
        yield Finding(("engine",), what)
    for name in winds[1:]:
        yield Finding(("rules", name), f"a second wind beside {winds[0]}", name, at="key")
    body, sharing = next(rigid_bodies(spec), None), next(_sharing(spec), None)
    if body is not None and sharing is not None:
        for one, other in ((body, sharing), (sharing, body)):
            what = f"{one.what}, which no engine solves beside {'.'.join(other.location)}, {other.what}"
            yield Finding(one.location, what, one.location[-1], at="key")
        return
    wrong, needed = (sharing, "pure" if ENGINES["bullet"].lack else "bullet") if engine.islands else (body, "mujoco")
    if wrong is not None:
        place = ".".join(wrong.location)
        what = f"engine {engine.name!r} supports only {engine.bodies}; {place} is {wrong.what}: set engine: {needed}"
        yield Finding(("engine",), what)


def _sharing(spec: Deployment) -> Iterator[_Rigid]:
    """Yield the robots, or else the objects of kits, that may share a solve."""
    for name, robot in spec.robots.items():
        if (model := robot.component_type).shares_solve:
            yield _Rigid(("robots", name), with_article(model.name))
    for key, kit in spec.kit_types.items():
        for model_name in kit.entities.values():
            if registry.find_model(model_name).shares_solve:
                yield _Rigid((key,), with_article(model_name))


def rigid_bodies(spec: Deployment) -> Iterator[_Rigid]:
    """Yield the robots and objects that need an engine with bodies of any kind."""
    for section, entities in (("robots", spec.robots), ("objects", spec.objects)):
        for name, settings in entities.items():
            model = settings.component_type
            if model.is_rigid and model.couples:
                yield _Rigid((section, name), with_article(model.name))


# --- the table --------------------------------------------------------------------------------------------------------


class Check(NamedTuple):
    """A row of the table. A check is `of_entries` where it reads each entry alone."""

    name: str
    find: Find
    of_entries: bool = False


BETWEEN: Final = (
    Check("kits and what they bring", _kits),
    Check("names", _names),
    Check("labels", _labels),
    Check("processes", _processes),
    Check("hosts", _hosts),
    Check("owners of robots", _nodes),
    Check("robots of players", _players),
    Check("what players hear", _hears),
    Check("settings that depend on each other", _settings),
    Check("components of gateways", _gateways),
    Check("scenery", _scenery),
    Check("network", lambda deployment, ends: check_network(deployment.network, ends)),
    Check("times", _times, of_entries=True),
    Check("what models and components need", needs, of_entries=True),
)
COMPONENTS: Final = (Check("settings of components", _components, of_entries=True),)
STATE: Final = (
    (Check("slots are declared once", _doubled_slots),),
    (Check("spares", _lasting_spares),),
    (Check("triggers of sensors", _unheard),),
    (Check("trial of other packages' components", _trial),),
    (Check("start and events", _start), Check("components on their robots", _unfit_components)),
    (Check("joints that actuators share", _competing),),
)
"""Of the state of a world, whose robots' files must be there."""
WHOLE: Final = (
    Check("surfaces and gravity", lambda deployment, ends: findings_of(deployment)),
    Check("engine", _engine),
    Check("settings of rules over radios", lambda d, ends: rule_findings(d.profiles(), ends.names)),
    Check("places of endpoints on air", lambda deployment, ends: place_findings(deployment)),
)
FILES: Final = ((Check("walls of meshes", _open_meshes),), (Check("what models and components need", needs),))


def stages(deployment: Deployment, *, with_files: bool = False) -> Iterator[tuple[Deployment, tuple[Check, ...]]]:
    """Yield the checks of a deployment by stages; each rests on those before, and is for one without problems in them.
    Beside them is the deployment to check: once its robots are known, with the names of their joints.

    `with_files`: only the checks that need the contents of files, for a deployment that was loaded without problems.
    """
    if with_files:
        yield from ((deployment, stage) for stage in (*FILES, *(STATE if deployment.asset_files else ())))
        return
    yield deployment, BETWEEN
    yield deployment, COMPONENTS
    if not deployment.lacks_files:
        deployment = deployment.with_joint_names()
        yield from ((deployment, stage) for stage in STATE)
    yield deployment, WHOLE
