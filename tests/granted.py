"""A second opinion on who may do what on the keys of a plane, written down by hand: no table of channels, no rules.

`protocol/access.py` generates what Zenoh enforces; tests of the generator and of real sessions compare it with this.
A new channel gets its place here by somebody who thinks about it.
"""

from typing import Final

S: Final = "foosim/simulation"
R: Final = "foosim/radio"
P: Final = "foosim/replay"


def is_end_of(key: str, name: str) -> bool:
    """Whether a key's last part is one of the many ends of a person's sessions."""
    return key.rpartition("/")[2].startswith(f"{name}.")


def may_put(identity: str, key: str) -> bool:
    """Whether what this identity puts on a key is let in."""
    role, _, name = identity.partition(".")
    match role:
        case "node":
            of_node = ("hello", "fetch", "ready", "part", "samples", "want", "heartbeat", "farewell")
            return key in {f"{S}/{what}/{name}" for what in of_node}
        case "vhub":
            of_vhub = ("hello", "fetch", "ready", "resume_state", "want", "heartbeat", "farewell")
            return key in {f"{S}/deliveries", *(f"{S}/{what}/vhub" for what in of_vhub)}
        case "operator":
            asks = {f"{P}/request", f"{S}/request", f"{S}/inquiry", f"{S}/fetch"}
            return key.rpartition("/")[0] in asks and is_end_of(key, name)
        case "viewer":
            return key.rpartition("/")[0] in {f"{S}/inquiry", f"{S}/fetch"} and is_end_of(key, name)
        case "client":
            return key in {f"{R}/{what}/{name}" for what in ("hello", "file_request", "up")}
    return False


def may_hear(identity: str, key: str) -> bool:
    """Whether this identity hears what is put on a key."""
    role, _, name = identity.partition(".")
    match role:
        case "node":
            to_all = {f"{S}/{what}" for what in ("recall", "prepare", "epoch", "order", "deliveries", "end")}
            to_it = {f"{S}/{what}/{name}" for what in ("build", "piece", "refusal", "commit")}
            return key in to_all | to_it or key.startswith((f"{S}/part/", f"{S}/want/"))
        case "vhub":
            to_all = {f"{S}/{what}" for what in ("recall", "epoch", "tempo", "watched", "end")}
            to_it = {f"{S}/{what}/vhub" for what in ("build", "piece", "refusal", "resume_grant", "commit")}
            return key in to_all | to_it or key.startswith((f"{S}/samples/", f"{S}/want/"))
        case "operator":
            to_it = {f"{S}/answer", f"{S}/piece", f"{P}/answer"}
            addressed = key.rpartition("/")[0] in to_it and is_end_of(key, name)
            return addressed or key == f"{S}/view" or key.startswith(f"{P}/played/")
        case "viewer":
            addressed = key.rpartition("/")[0] in {f"{S}/answer", f"{S}/piece"} and is_end_of(key, name)
            return addressed or key == f"{S}/view"
        case "client":
            return key in {f"{R}/{what}/{name}" for what in ("welcome", "refusal", "file_piece", "down")}
    return False


def may_be_present(identity: str, key: str) -> bool:
    """Whether a token of this identity is let in under a key."""
    role, _, name = identity.partition(".")
    return key == {"node": f"{S}/alive/{name}", "vhub": f"{S}/alive/vhub", "client": f"{R}/alive/{name}"}.get(role)


def may_watch(identity: str, key: str) -> bool:
    """Whether this identity hears of a presence under a key: of its router's."""
    if key == f"{P}/alive/replay":
        return identity.startswith("operator.")
    return key == (f"{R}/alive/vhub" if identity.startswith("client.") else f"{S}/alive/supervisor")
