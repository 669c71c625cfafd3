"""The stages of a link, in their fixed order: a table that the hub walks.

Each stage is one file with a class (`stage.Stage`) that is made from a link's setup. It has two hooks, at sending and
at arrival; a hook that drops the packet returns the name of the cause. A stage that has nothing to do on a link is left
out there.
What a stage remembers is a plain value in the hub's state: of the link, of the sender's radio or of the air. To add
one: its file, and its row here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.stages.admission import Admit
from foosim.vhub.stages.channel import Channel
from foosim.vhub.stages.corruption import Mangle
from foosim.vhub.stages.custom_model import Own
from foosim.vhub.stages.delay import Delay
from foosim.vhub.stages.duty import Duty
from foosim.vhub.stages.medium import make_medium
from foosim.vhub.stages.policy import Policy
from foosim.vhub.stages.queue import Queue
from foosim.vhub.stages.receiver import Receiver
from foosim.vhub.stages.residual import make_residual
from foosim.vhub.stages.stage import Stage

STAGES: Final[tuple[Callable[[LinkSetup], Stage | None], ...]] = (
    Admit.for_link,
    Policy.for_link,
    Duty.for_link,
    Queue.for_link,
    make_medium,
    Channel.for_link,
    make_residual,
    Own.for_link,
    Mangle.for_link,
    Delay.for_link,
    Receiver.for_link,
)
