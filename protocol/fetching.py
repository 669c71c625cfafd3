"""How the files that a deployment refers to travel: the handshake's answer to who has to build the world.

The deployment's text names each file by its digest. Who lacks one asks for it piece by piece, each as soon as the one
before has come, and again after a while; so there is one piece on its way at a time, whatever the link, and nobody has
to remember how far anybody is. What has come is taken if its digest is the one in the text.
Neighbours: `member` asks, `supervisor.handshake` answers, `deployment` says which files there are.
"""

from __future__ import annotations

from collections.abc import Mapping

from foosim.protocol import limits
from foosim.protocol.deployment import Deployment
from foosim.protocol.errors import Malformed
from foosim.protocol.mesh import digest_of
from foosim.protocol.messages import Fetch, Piece


class Fetching:
    """The files that one build needs, and how far they have come."""

    def __init__(self, deployment: Deployment, files: Mapping[str, bytes]) -> None:
        """`files` are those, by digest, that an earlier build brought. Raises Malformed for one without a digest."""
        self._digests: dict[str, str] = {}
        for path, digest in deployment.files().items():
            if digest is None:
                raise Malformed(f"a build whose file {path} has no digest")
            self._digests[path] = digest
        self.files = {digest: files[digest] for digest in self._digests.values() if digest in files}
        """Contents that are whole, by digest."""
        self._bytes = bytearray()
        """What there is of the first that is not."""

    @property
    def lacking(self) -> tuple[str, int] | None:
        """The digest of the next file and where its next piece begins; None when all are there."""
        digest = next((digest for digest in self._digests.values() if digest not in self.files), None)
        return None if digest is None else (digest, len(self._bytes))

    def take(self, piece: Piece) -> bool:
        """Take the piece that is lacking; False for any other one. Raises Malformed when it cannot be what it says."""
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
        """The files by path, when all are there."""
        return {path: self.files[digest] for path, digest in self._digests.items()}


def piece_of(deployment: Deployment, fetch: Fetch) -> Piece:
    """Return the piece that is asked for of a deployment's files; raises Malformed when there is none."""
    content = deployment.file_with(fetch.digest.hex())
    if content is None:
        raise Malformed(f"a fetch of a file that the deployment does not have, {fetch.digest.hex()[:16]}")
    if fetch.offset > len(content):
        raise Malformed(f"a fetch from byte {fetch.offset} of a file of {len(content)}")
    piece = content[fetch.offset : fetch.offset + limits.ASSET_PIECE_BYTES]
    return Piece(fetch.name, fetch.boot, fetch.digest, fetch.offset, len(content), piece)
