"""The stages of a link, in their fixed order: a table that the hub walks.

Each stage is one file with a class (`stage.Stage`), constructed with a link's setup. It has two hooks, at sending and
at arrival; a hook that drops the packet returns the name of the cause. A stage that has nothing to do on a link is left
out there.
What a stage remembers is a plain value in the hub's state: of the link, of the sender's radio or of the air. To add
one: its file, and its row here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.radio.propagation import BLOCKED, OUT_OF_RANGE
from foosim.vhub.stages.admission import NO_ROUTE, NODE_DOWN, TOO_BIG, Admission
from foosim.vhub.stages.channel import Channel
from foosim.vhub.stages.corruption import CRC_FAIL, Corruption
from foosim.vhub.stages.custom_model import MODEL, MODEL_FAILED, CustomModel
from foosim.vhub.stages.delay import Delay
from foosim.vhub.stages.duty import DUTY_CYCLE, Duty
from foosim.vhub.stages.medium import COLLISION, SNR, make_medium
from foosim.vhub.stages.policy import EXPIRED, FILTERED, PARTITION, Policy
from foosim.vhub.stages.queue import CODEL, QUEUE_FULL, Queue
from foosim.vhub.stages.receiver import RECEIVER_DOWN, RECEIVER_FULL, TRANSIT_FULL, Receiver
from foosim.vhub.stages.residual import BURST_LOSS, RANDOM_LOSS, make_residual
from foosim.vhub.stages.stage import Stage

STAGES: Final[tuple[tuple[str, Callable[[LinkSetup], Stage | None], tuple[str, ...]], ...]] = (
    ("admission", Admission.for_link, (TOO_BIG, NODE_DOWN, NO_ROUTE)),
    ("policy", Policy.for_link, (PARTITION, FILTERED, EXPIRED)),
    ("duty", Duty.for_link, (DUTY_CYCLE,)),
    ("queue", Queue.for_link, (QUEUE_FULL, CODEL, EXPIRED)),
    ("medium", make_medium, (COLLISION,)),
    ("channel", Channel.for_link, (OUT_OF_RANGE, BLOCKED, SNR, COLLISION)),
    ("residual", make_residual, (RANDOM_LOSS, BURST_LOSS)),
    ("custom_model", CustomModel.for_link, (MODEL, MODEL_FAILED)),
    ("corruption", Corruption.for_link, (CRC_FAIL,)),
    ("delay", Delay.for_link, ()),
    ("receiver", lambda _: Receiver(), (RECEIVER_DOWN, RECEIVER_FULL, TRANSIT_FULL)),
)
"""Each with its name and the causes of its drops.

`expired` is the policy's at arrival and the queue's at sending; `collision` the medium's while stations contend, else
the channel's.
"""
