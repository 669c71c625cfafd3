"""The parts of your own components: decorators, settings, views, units, bodies.

`m`, `rad`, `m_s` and so on are the types of numbers in readings and commands: floats with a unit. `Length`, `Speed`
and so on are the types of settings: texts with a unit in a deployment, SI numbers in the code.
"""

from foosim.common import units
from foosim.common.batched.noise import NoiseKey
from foosim.common.exact_math import cos, sin
from foosim.common.finding import Finding
from foosim.common.keyed_random import chance_threshold
from foosim.common.spec_base import Force, Length, Mass, Rate, SpecBase, Speed, Spin, Torque, default
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import ROBOTS, Carrier
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.per_field import PerField
from foosim.world.component_types.quantities import Amperes as A
from foosim.world.component_types.quantities import Degrees as deg
from foosim.world.component_types.quantities import JobNumber
from foosim.world.component_types.quantities import Metres as m
from foosim.world.component_types.quantities import MetresPerSecond as m_s
from foosim.world.component_types.quantities import MetresPerSecondSquared as m_s2
from foosim.world.component_types.quantities import NewtonMetres as Nm
from foosim.world.component_types.quantities import Newtons as N
from foosim.world.component_types.quantities import NewtonSeconds as Ns
from foosim.world.component_types.quantities import Radians as rad
from foosim.world.component_types.quantities import RadiansPerSecond as rad_s
from foosim.world.component_types.quantities import Share as share
from foosim.world.component_types.quantities import Volts as V
from foosim.world.component_types.quantities import Watts as W
from foosim.world.component_types.registry import actuator, kit, model, modifier, rule, scene, sensor
from foosim.world.component_types.settings import (
    ActuatorSettings,
    EntityRuleSettings,
    ModifierSettings,
    RobotSettings,
    RuleSettings,
    SceneSettings,
    SensorSettings,
)
from foosim.world.components.base import Actuator, EntityRule, Kit, Model, Modifier, Motion, Rule, Sensor, need, slot
from foosim.world.components.entities import Marked, MarkKind, MotionMounting, Motors, RuleMounting
from foosim.world.components.mounted import Mounted
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import IncompatibleComponent, ModifierMounting, Mounting, View, WritableView
from foosim.world.frame import Frame
from foosim.world.layout import Entity
from foosim.world.matter.materials import CONCRETE, METAL, PLASTIC, WOOD
from foosim.world.matter.physics import Physics
from foosim.world.placing import MountedAt
from foosim.world.scene import ORIGIN, Body, Box, Capsule, Cylinder, Link, Shape, Sphere
from foosim.world.spec import WorldSpec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from foosim.vhub.network.custom_models import Judged

__all__ = [
    "CONCRETE",
    "METAL",
    "ORIGIN",
    "PLASTIC",
    "ROBOTS",
    "WOOD",
    "A",
    "Actuator",
    "ActuatorSettings",
    "Body",
    "Box",
    "Capsule",
    "Carrier",
    "Cylinder",
    "Entity",
    "EntityRule",
    "EntityRuleSettings",
    "Finding",
    "Force",
    "Frame",
    "IncompatibleComponent",
    "JobNumber",
    "JobState",
    "Judged",
    "Kit",
    "Length",
    "Link",
    "MarkKind",
    "Marked",
    "Mass",
    "Model",
    "Modifier",
    "ModifierMounting",
    "ModifierSettings",
    "Motion",
    "MotionMounting",
    "Motors",
    "Mounted",
    "MountedAt",
    "Mounting",
    "N",
    "Nm",
    "NoiseKey",
    "Ns",
    "PerField",
    "Physics",
    "Quantity",
    "Rate",
    "RobotSettings",
    "Rule",
    "RuleMounting",
    "RuleSettings",
    "SceneSettings",
    "Sensor",
    "SensorSettings",
    "Shape",
    "SpecBase",
    "Speed",
    "Sphere",
    "Spin",
    "Surroundings",
    "Torque",
    "V",
    "View",
    "W",
    "WorldSpec",
    "WritableView",
    "actuator",
    "chance_threshold",
    "cos",
    "default",
    "deg",
    "kit",
    "m",
    "m_s",
    "m_s2",
    "model",
    "modifier",
    "need",
    "rad",
    "rad_s",
    "rule",
    "scene",
    "sensor",
    "share",
    "sin",
    "slot",
    "units",
]


def __getattr__(name: str) -> object:
    """Import the results of link models at their first use: no other component needs the network."""
    import sys

    if name == "Judged":
        from foosim.vhub.network import custom_models

        return custom_models.Judged
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
