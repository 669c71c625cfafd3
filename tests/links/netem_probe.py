"""Sends numbered packets over the loopback of this network namespace, and prints how long each was on its way.

`python netem_probe.py COUNT PERIOD_US` prints a JSON list: nanoseconds by number, null for what did not come within a
second after the last one. Whoever starts it has put a queueing discipline there.
"""

import json
import select
import socket
import sys
import time


def main() -> None:
    count, period_ns = int(sys.argv[1]), int(sys.argv[2]) * 1000
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    receiver.setblocking(False)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.connect(receiver.getsockname())
    sent: list[int] = []
    delays: list[int | None] = [None] * count
    begun_ns = time.monotonic_ns()
    end_ns = begun_ns + count * period_ns + 1_000_000_000
    while (now_ns := time.monotonic_ns()) < end_ns:
        due_ns = begun_ns + len(sent) * period_ns if len(sent) < count else end_ns
        if due_ns <= now_ns:
            sent.append(time.monotonic_ns())
            sender.send((len(sent) - 1).to_bytes(4, "little"))
            continue
        if select.select([receiver], [], [], (due_ns - now_ns) / 1e9)[0]:
            number = int.from_bytes(receiver.recv(16), "little")
            delays[number] = time.monotonic_ns() - sent[number]
    print(json.dumps(delays))


if __name__ == "__main__":
    main()
