"""The parts of your own gateways: the base class, its settings and what it sees of a run."""

from foosim.common.errors import Refused
from foosim.gateways.gateway import Gateway, Peer
from foosim.gateways.rows import Component
from foosim.gateways.run import Called, Run
from foosim.world.component_types.registry import gateway
from foosim.world.component_types.settings import GatewaySettings
from foosim.world.scene import from_rpy

__all__ = ["Called", "Component", "Gateway", "GatewaySettings", "Peer", "Refused", "Run", "from_rpy", "gateway"]
