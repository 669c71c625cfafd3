"""The cat's controller of Cat and Mouse, for any server that speaks MORSE's socket protocol; it takes the port.

It sends a new motion when what the cameras see has changed, as the tutorial's does.
"""

import sys
import time

import pymorse

# On Python 3.8 to 3.11 a program of pymorse 1.4 does not end without this.
pymorse.Component.__dir__ = lambda self: sorted({*vars(self), *vars(type(self))})

MOTIONS = {
    (True, True): {"v": 2.0, "w": 0.0},
    (True, False): {"v": 1.5, "w": 1.0},
    (False, True): {"v": 1.5, "w": -1.0},
    (False, False): {"v": 0.0, "w": -1.0},
}
"""Speed (m/s) and turn rate (rad/s), by whether the left and the right camera see the mouse."""


def is_seen_by(camera):
    """Whether the mouse is among what a camera has seen last."""
    return any(thing["name"] == "MOUSE" for thing in camera.last()["visible_objects"])


with pymorse.Morse(port=int(sys.argv[1]) if len(sys.argv) > 1 else 4000) as simulation:
    cat = simulation.cat
    # `last` opens a stream, and has nothing to return at once: wait for a first message of each.
    cat.cameraL.get(), cat.cameraR.get()
    last = None
    while True:  # until Ctrl-C
        seen = is_seen_by(cat.cameraL), is_seen_by(cat.cameraR)
        if seen != last:
            cat.motion.publish(MOTIONS[seen])
            last = seen
        time.sleep(0.02)
