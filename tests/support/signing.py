"""A key whose signatures are those of ssh-keygen (tests/unit/test_signed_files.py holds them to its own)."""

import base64
import hashlib
from pathlib import Path

from nacl.signing import SigningKey

from gateway.files.signed import PublicKey, armoured, signature_path, to_be_signed


class Signer:
    """The same name gives the same key."""

    def __init__(self, name: str) -> None:
        self._private = SigningKey(hashlib.sha256(name.encode()).digest())
        head, point = b"\0\0\0\x0bssh-ed25519\0\0\0\x20", bytes(self._private.verify_key)
        self.public_line = f"ssh-ed25519 {base64.b64encode(head + point).decode()} {name}"
        self.public = PublicKey.of(self.public_line)

    def signature_of(self, content: bytes, hash_name: str = "sha512") -> str:
        """The text of FILE.sig for what FILE holds."""
        return armoured(self.public, hash_name, self._private.sign(to_be_signed(content, hash_name)).signature)

    def sign(self, *paths: Path) -> None:
        """Write the signature beside each file."""
        for path in paths:
            signature_path(path).write_text(self.signature_of(path.read_bytes()))
