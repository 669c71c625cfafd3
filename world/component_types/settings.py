"""The common settings of all component types in a deployment."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, PrivateAttr, SerializeAsAny, StringConstraints

from foosim.common import limits, names
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.spec_base import Name, Offset, Rate, SpecBase, default
from foosim.common.units import custom_error

MODIFIERS_MAX: Final = 8
COMPONENTS_MAX: Final = 16
TAGS_MAX: Final = 16
LABEL_LENGTH_MAX: Final = 64


def _printable(label: str) -> str:
    if not label.isprintable():
        raise custom_error(BadValue("not printable characters", label))
    return label


Tag = Annotated[str, StringConstraints(pattern=names.NAME_PATTERN, max_length=limits.NAME_LENGTH_MAX)]
Label = Annotated[
    str,
    StringConstraints(min_length=1, max_length=LABEL_LENGTH_MAX),
    AfterValidator(_printable),
    Field(description=f"1 to {LABEL_LENGTH_MAX} printable characters"),
]
"""The name for people and for other programs, in place of the name in the deployment; any printable characters."""

RobotSelector = Annotated[str, StringConstraints(pattern=names.SELECTOR_PATTERN, max_length=names.SELECTOR_LENGTH_MAX)]
"""Robots by name, or by a pattern of names."""


def client_on(gateway: str, robot: str) -> str:
    """Return the name of a gateway's client on board of a robot."""
    return f"{gateway}-{robot.replace('.', '-')}"


class TypedSettings(SpecBase):
    """Settings that know the component type that they were read for: it is resolved once, when they are read."""

    _component_type: Any = PrivateAttr(default=None)

    def typed(self, component_type: Any) -> Self:
        """The same, which are for a component type from now on."""
        self._component_type = component_type
        return self

    @property
    def component_type(self) -> Any:
        """The registered component type; of an entity its model, in the variant that the settings choose."""
        return self._component_type


class ComponentSettings(TypedSettings):
    """The settings of each component: its kind, a registered name or `module:Class`."""

    kind: str


class ModifierSettings(ComponentSettings):
    """The settings of each modifier."""


class SensorSettings(ComponentSettings):
    """The settings of each sensor: its rate, the modifiers of its readings, in order, and its label."""

    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)
    label: Label = ""

    @property
    def carried_bytes(self) -> int | None:
        """The size of a packet for the network; None: the length of its payload."""
        return None

    @property
    def late_by_ns(self) -> int:
        """By how much later than its tick and the network's delay a packet arrives."""
        return 0


class ActuatorSettings(ComponentSettings):
    """The settings of each actuator: the modifiers of its commands, in order, and its label."""

    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)
    label: Label = ""


class EntityRuleSettings(ComponentSettings):
    """The settings of each rule of an entity."""


class RuleSettings(ComponentSettings):
    """The settings of each rule of the world."""


class SceneSettings(ComponentSettings):
    """The settings of each scene."""


class GatewaySettings(ComponentSettings):
    """The settings of each gateway: the robots that it serves, and who starts its process.

    On board of each of these is a client of the run, `NAME-ROBOT`, with dots as dashes, which hears the robot's sensors
    and commands it; the client `NAME` is on board of none. Programs know a robot by its label, if it has one, or by the
    name in `names`. `classes` chooses the class of a component, `ROBOT.CHANNEL`,
    where its type has several; `alter` are the frames in which its numbers are given, in order.
    """

    robots: list[RobotSelector] = Field(default=["*"], max_length=limits.ENTITIES_MAX)
    launch: Literal["local", "manual"] = "local"
    names: dict[str, Label] = Field(default={}, max_length=limits.ENTITIES_MAX)
    classes: dict[str, str] = Field(default={}, max_length=limits.ENTITIES_MAX)
    alter: dict[str, list[str]] = Field(default={}, max_length=limits.ENTITIES_MAX)

    def clients(self, name: str) -> dict[str, str]:
        """Return the clients of the gateway with this name by robot; its own one is that of no robot, an empty name."""
        return {"": name} | {robot: client_on(name, robot) for robot in self.robots}


class EntitySettings(TypedSettings):
    """The settings of every entity: its model, a registered name or `module:Class`.

    `tags` are found by components and rules, beside the tags of its model. A `spare` is absent until it is added.
    A `label` is its name at gateways, and changes nothing in the world.
    """

    model: str
    spare: bool = False
    tags: list[Tag] = Field(default=[], max_length=TAGS_MAX)
    label: Label = ""

    @property
    def felt_surfaces(self) -> Mapping[Location, str]:
        """The surfaces that rigid bodies feel of it, by the place of the setting that names them."""
        return {}


class RobotSettings(EntitySettings):
    """The settings of every robot: sensors and actuators by the names of their channels, rules by name.

    A robot without a setting of its actuators, or of its rules, has those of its model.
    """

    sensors: dict[Name, SerializeAsAny[SensorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
    actuators: dict[Name, SerializeAsAny[ActuatorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
    rules: dict[Name, SerializeAsAny[EntityRuleSettings]] = Field(default={}, max_length=COMPONENTS_MAX)

    def asset_paths(self, files: Mapping[str, bytes]) -> Sequence[str]:
        """Return the files of its model, by paths inside the asset folder: the files that the settings name, and the
        files that these name in turn, where `files`, contents by path, has them. Raises AssetError."""
        return ()

    def check_assets(self, files: Mapping[str, bytes]) -> None:
        """Raise AssetError for an invalid file; all that `asset_paths` names are in `files`."""


BASES: Final[Mapping[str, type[SpecBase]]] = MappingProxyType(
    {
        "sensor": SensorSettings,
        "actuator": ActuatorSettings,
        "modifier": ModifierSettings,
        "entity_rule": EntityRuleSettings,
        "rule": RuleSettings,
        "scene": SceneSettings,
        "gateway": GatewaySettings,
        "model": EntitySettings,
    }
)
"""The base class of the settings of a component type; settings of kits are any."""
