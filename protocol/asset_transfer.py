"""Transfers the files that a deployment refers to, as part of a handshake.

The deployment's text names each file by its digest. A process requests a missing file piece by piece, each as soon as
the one before has arrived, and again after a while; so one piece is in flight at a time, and the sender keeps no state.
A file is accepted if its digest is the one in the text.
"""

from __future__ import annotations

from collections.abc import Mapping

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Fetch, Piece
from foosim.world.matter.mesh import digest_of


class Fetching:
    """The files that a process needs, and the progress of their transfer."""

    def __init__(self, needed: Mapping[str, str | None], files: Mapping[str, bytes]) -> None:
        """`needed` are digests by path, `files` known contents by digest. Raises Malformed without a digest."""
        self._digests: dict[str, str] = {}
        for path, digest in needed.items():
            if digest is None:
                raise Malformed(f"a build whose file {path} has no digest")
            self._digests[path] = digest
        self.files = {digest: files[digest] for digest in self._digests.values() if digest in files}
        """Complete contents, by digest."""
        self._bytes = bytearray()
        """The received part of the first incomplete file."""

    @property
    def lacking(self) -> tuple[str, int] | None:
        """The digest of the next file and where its next piece begins; None when all are there."""
        digest = next((digest for digest in self._digests.values() if digest not in self.files), None)
        return None if digest is None else (digest, len(self._bytes))

    def take(self, piece: Piece) -> bool:
        """Accept the missing piece; False for any other one. Raises Malformed when size or digest do not fit."""
        if self.lacking != (piece.digest.hex(), piece.offset):
            return False
        end = piece.offset + len(piece.content)
        if end > piece.size or (end < piece.size and not piece.content):
            raise Malformed(f"a piece up to byte {end} of a file of {piece.size}")
        self._bytes += piece.content
        if end == piece.size:
            content = bytes(self._bytes)
            self._bytes.clear()
            if digest_of(content) != piece.digest.hex():
                raise Malformed(f"a file of {piece.size} bytes with another digest than {piece.digest.hex()[:16]}")
            self.files[piece.digest.hex()] = content
        return True

    def contents(self) -> dict[str, bytes]:
        """The files by path, when all have arrived."""
        return {path: self.files[digest] for path, digest in self._digests.items()}


def piece_of(deployment: Deployment, fetch: Fetch, most: int | None = None) -> Piece:
    """Return the requested piece of a deployment's files, of at most `most` bytes, by default as many as a piece has.

    Raises Malformed when there is none.
    """
    content = deployment.file_with(fetch.digest.hex())
    if content is None:
        raise Malformed(f"a fetch of a file that the deployment does not have, {fetch.digest.hex()[:16]}")
    if fetch.offset > len(content):
        raise Malformed(f"a fetch from byte {fetch.offset} of a file of {len(content)}")
    piece = content[fetch.offset : fetch.offset + (most or limits.ASSET_PIECE_BYTES)]
    return Piece(fetch.name, fetch.boot, fetch.digest, fetch.offset, len(content), piece)
