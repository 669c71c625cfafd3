"""foosim from Python: simulations, clients, captures, rehearsals, and the base class of a controller.

    import foosim

    with foosim.Simulation("deploy/table.yaml") as simulation:
        simulation.step({"red.goal": {"slide": 0.05, "spin": 0.0}})

`foosim.components` has the base classes and types of your own components, `foosim.gateway` those of your own gateways,
`foosim.env` environments for learning.
Modules are imported at their first use.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from foosim import components, env, gateway
    from foosim._capture import Capture, open_capture
    from foosim._rehearse import load_deployment, rehearse
    from foosim._sweep import sweep
    from foosim.client.client import Client, connect
    from foosim.client.jobs import Jobs
    from foosim.client.player import Commands, Packet, Player, Sample, Samples, Turn
    from foosim.client.replay_listener import hear_replay
    from foosim.common.errors import Refused
    from foosim.deployment.schema import Deployment
    from foosim.protocol.replay_messages import PlayedPacket, PlayedPoses
    from foosim.simulation.simulation import Simulation
    from foosim.world.component_types.jobs import JobState

__all__ = [
    "Capture",
    "Client",
    "Commands",
    "Deployment",
    "JobState",
    "Jobs",
    "Packet",
    "PlayedPacket",
    "PlayedPoses",
    "Player",
    "Refused",
    "Sample",
    "Samples",
    "Simulation",
    "Turn",
    "components",
    "connect",
    "env",
    "gateway",
    "hear_replay",
    "load_deployment",
    "open_capture",
    "rehearse",
    "sweep",
]
_MODULES = {
    "foosim._capture": ("Capture", "open_capture"),
    "foosim._rehearse": ("load_deployment", "rehearse"),
    "foosim._sweep": ("sweep",),
    "foosim.client.client": ("Client", "connect"),
    "foosim.client.jobs": ("Jobs",),
    "foosim.client.player": ("Commands", "Packet", "Player", "Sample", "Samples", "Turn"),
    "foosim.client.replay_listener": ("hear_replay",),
    "foosim.common.errors": ("Refused",),
    "foosim.deployment.schema": ("Deployment",),
    "foosim.protocol.replay_messages": ("PlayedPacket", "PlayedPoses"),
    "foosim.simulation.simulation": ("Simulation",),
    "foosim.world.component_types.jobs": ("JobState",),
}


def __getattr__(name: str) -> object:
    """Import a name at its first use."""
    import sys
    from importlib import import_module

    if name in ("components", "env", "gateway"):
        return import_module(f"foosim.{name}")
    for module, names in _MODULES.items():
        if name in names:
            found: object = getattr(import_module(module), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])


def __dir__() -> list[str]:
    return [*__all__]
