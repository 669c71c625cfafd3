"""What the settings of all forms have, in a deployment."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Final, Self

from pydantic import Field, PrivateAttr, SerializeAsAny, StringConstraints

from foosim.common import limits, names
from foosim.common.spec_base import Name, Offset, Rate, SpecBase, default

MODIFIERS_MAX: Final = 8
COMPONENTS_MAX: Final = 16
TAGS_MAX: Final = 16

Tag = Annotated[str, StringConstraints(pattern=names.NAME_PATTERN, max_length=limits.NAME_LENGTH_MAX)]


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
    """What the settings of each component have: its kind, a registered name or `module:Class`."""

    kind: str


class ModifierSettings(ComponentSettings):
    """What the settings of each modifier have."""


class SensorSettings(ComponentSettings):
    """What the settings of each sensor have: how often it measures, and what is done to its readings, in order."""

    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)


class ActuatorSettings(ComponentSettings):
    """What the settings of each actuator have: what is done to its commands, in order."""

    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)


class EntityRuleSettings(ComponentSettings):
    """What the settings of each rule of an entity have."""


class RuleSettings(ComponentSettings):
    """What the settings of each rule of the world have."""


class SceneSettings(ComponentSettings):
    """What the settings of each scene have."""


class EntitySettings(TypedSettings):
    """What the settings of every entity have: its model, a registered name or `module:Class`.

    `tags` are for those who look for entities of a kind, beside the tags of its model. A `spare` is absent until it is
    added.
    """

    model: str
    spare: bool = False
    tags: list[Tag] = Field(default=[], max_length=TAGS_MAX)

    @property
    def felt_surfaces(self) -> Mapping[str, str]:
        """The surfaces that rigid bodies feel of it, by the setting that names them."""
        return {}


class RobotSettings(EntitySettings):
    """What the settings of every robot have: sensors and actuators by the names of their channels, rules by name.

    A robot that says nothing of its actuators, or of its rules, has those of its model.
    """

    sensors: dict[Name, SerializeAsAny[SensorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
    actuators: dict[Name, SerializeAsAny[ActuatorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
    rules: dict[Name, SerializeAsAny[EntityRuleSettings]] = Field(default={}, max_length=COMPONENTS_MAX)

    def asset_paths(self, files: Mapping[str, bytes]) -> Sequence[str]:
        """Return the files that its model is made from, by paths inside the asset folder: those that the settings name,
        and of those that are in `files`, contents by path, the ones that these name in turn. Raises AssetError."""
        return ()

    def check_assets(self, files: Mapping[str, bytes]) -> None:
        """Raise AssetError for a file that is not acceptable; all that `asset_paths` names are in `files`."""


BASES: Final[Mapping[str, type[SpecBase]]] = MappingProxyType(
    {
        "sensor": SensorSettings,
        "actuator": ActuatorSettings,
        "modifier": ModifierSettings,
        "entity_rule": EntityRuleSettings,
        "rule": RuleSettings,
        "scene": SceneSettings,
        "model": EntitySettings,
    }
)
"""What the settings of a form have in common with all others of it; settings of kits are any."""
