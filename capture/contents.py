"""The content of a capture beside its rows: topics with their schemas, attachments, and metadata."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType
from typing import Final

from foosim.capture.foxglove import VIEW_TYPES, view_schema
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.parts import (
    AFTER,
    AFTER_BYTES,
    FAILED_RUN,
    LAST,
    ORIGIN,
    ORIGIN_CHAIN,
    ORIGIN_DIGEST,
    ORIGIN_TICK,
    PART,
    parts_at,
)
from foosim.capture.rows import ROW_TYPES, json_schema
from foosim.capture.shown_readings import TopicSchema
from foosim.common.json_text import encode_json
from foosim.protocol.messages import End
from foosim.world.start import Origin

DEPLOYMENT: Final = "deployment.yaml"
ASSETS: Final = "assets/"
"""How the names of the files begin that the deployment refers to; their paths follow."""
VERSIONS: Final = "versions.json"
CHUNK_BYTES: Final = 4 * 1024 * 1024
"""A chunk is ended at this size, or when it is to be flushed; a reader holds one at a time."""
_LIBRARIES: Final = (
    *("foosim", "eclipse-zenoh", "foxglove-sdk", "mcap", "msgspec", "mujoco-core", "numpy", "pybullet", "pydantic"),
    "zstandard",
)
NO_READINGS: Final[Mapping[str, TopicSchema]] = MappingProxyType({})
CUT, CUT_TICK, CUT_DIGEST, CUT_CHAIN = "cut_from", "cut_tick", "cut_digest", "cut_chain"
"""Which capture a file is of that begins later, its first frame, its digest, and the chain up to it: entries of the
metadata `foosim`."""
CUT_REASON: Final = "cut"
"""The reason in the metadata at the end of a part."""
OWN: Final = frozenset({PART, AFTER, AFTER_BYTES, LAST, CUT, CUT_TICK, CUT_DIGEST, CUT_CHAIN})
"""The metadata that differ between the files of a capture."""


def origin_metadata(origin: Origin | None) -> dict[str, str]:
    """Return the metadata of the origin of a run."""
    if origin is None:
        return {}
    digest, chain = origin.digest.hex(), origin.chain.hex()
    return {ORIGIN: origin.source, ORIGIN_TICK: str(origin.tick), ORIGIN_DIGEST: digest, ORIGIN_CHAIN: chain}


def ending_metadata(end: End) -> dict[str, str]:
    """Return the metadata of the end of a run."""
    return {"reason": end.reason, **({FAILED_RUN: "true"} if end.failed else {})}


def declare_topics(mcap: McapWriter, readings: Mapping[str, TopicSchema] = NO_READINGS) -> dict[str, int]:
    """Declare all topics, also empty ones; return their channels.

    `readings` are the topics of readings that are shown (`shown_readings.shown_topics`).
    """
    its = [(topic, encoding, schema) for topic, (encoding, schema) in readings.items()]
    return {topic: mcap.add_channel(topic, encoding, schema) for topic, encoding, schema in (*_topics(), *its)}


@cache
def _topics() -> tuple[tuple[str, str, tuple[str, str, bytes]], ...]:
    """Return each topic with its encoding and schema, made once: a run waits while another file is begun."""
    topics = []
    for topic, kind in ROW_TYPES.items():
        schema = (f"foosim.{kind.__name__.removesuffix('Row')}", "jsonschema", encode_json(json_schema(kind)))
        topics.append((topic, "json", schema))
    for topic, message in VIEW_TYPES.items():
        topics.append((topic, "protobuf", view_schema(message)))
    return tuple(topics)


def library_versions() -> dict[str, str]:
    """Return the versions that a run depends on, for the capture."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def write_all(file: int, content: bytes) -> None:
    """Write to a file descriptor until all of it is written."""
    written = os.write(file, content)
    while written < len(content):
        written += os.write(file, content[written:])


def check_new(path: Path) -> None:
    """Raise CaptureError when a file exists at the path of a capture, or where it would continue."""
    for found in parts_at(path).values():
        raise CaptureError(f"{found}: exists already; a capture is never overwritten")
