"""Verification of signed files: FILE.sig beside FILE, as `ssh-keygen -Y sign` writes it for an ed25519 key.

This module cannot sign. It does not parse a signature: it writes one from the key and the last 64 bytes of the file,
and requires both to be identical, because the format allows only one form.

Format: PROTOCOL.sshsig of OpenSSH; public keys: RFC 8709, section 4; ed25519: RFC 8032.
"""

import base64
import binascii
import hashlib
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from nacl.exceptions import BadSignatureError
from nacl.signing import VerifyKey

from gateway.errors import ConfigurationError, UntrustedFileError

Read = Callable[[Path], bytes]  # reads a file; raises OSError, and UntrustedFileError for an untrusted one

SUFFIX: Final = ".sig"
COMMAND: Final = "ssh-keygen -Y sign -n springscale -f KEY"
NAMESPACE: Final = b"springscale"  # a signature for another purpose by the same key is not valid here
KEY_TYPE: Final = b"ssh-ed25519"
MAGIC: Final = b"SSHSIG"
VERSION: Final = (1).to_bytes(4)  # OpenSSH, PROTOCOL.sshsig
NO_SIGNATURE: Final = (
    f"its {SUFFIX} is no signature of an ed25519 key for the namespace springscale; sign it where the key is"
)
HASHES: Final = ("sha512", "sha256")  # ssh-keygen uses the first by default
BEGIN: Final = "-----BEGIN SSH SIGNATURE-----\n"
END: Final = "\n-----END SSH SIGNATURE-----\n"
COLUMNS: Final = 70  # of base64, as ssh-keygen writes
KEY_BYTES: Final = 32  # RFC 8032, as the next
SIGNATURE_BYTES: Final = 64
MOST_BYTES: Final = 4096  # of a signature file, which has about 300


def _string(content: bytes) -> bytes:
    """A string in SSH's encoding: its length, then its bytes (RFC 4251, section 5)."""
    return len(content).to_bytes(4) + content


@dataclass(frozen=True, slots=True)
class PublicKey:
    """An ed25519 public key that is trusted."""

    blob: bytes  # type and key in SSH's encoding

    def __post_init__(self) -> None:
        if self.blob != _string(KEY_TYPE) + _string(self.point) or len(self.point) != KEY_BYTES:
            raise ValueError("not an ed25519 key")

    @classmethod
    def of(cls, line: str) -> "PublicKey":
        """Parse a line of KEY.pub as ssh-keygen writes it: ssh-ed25519 AAAA... and an optional comment.

        Raises ValueError for any other line.
        """
        kind, encoded, *_ = (*line.split(), "", "")
        try:
            if kind.encode() != KEY_TYPE:
                raise ValueError
            return cls(base64.b64decode(encoded, validate=True))
        except ValueError:
            wanted = "the one line of KEY.pub that `ssh-keygen -t ed25519` made: ssh-ed25519 AAAA..."
            raise ValueError(f"not a public key; wanted is {wanted}") from None

    @property
    def point(self) -> bytes:
        return self.blob[-KEY_BYTES:]

    @property
    def fingerprint(self) -> str:
        """The fingerprint that `ssh-keygen -l` shows."""
        return "SHA256:" + base64.b64encode(hashlib.sha256(self.blob).digest()).decode().rstrip("=")


@dataclass(frozen=True, slots=True)
class Trust:
    """The trusted keys. A file must be signed by one of them; without keys every file is trusted."""

    keys: tuple[PublicKey, ...] = ()

    def read(self, path: Path, raw: Read = Path.read_bytes) -> bytes:
        """The content of a trusted file; ``raw`` reads the file and its signature, for example from an object store.

        Raises OSError, and UntrustedFileError that says what is wrong and how to mend it.
        """
        content = raw(path)
        if self.keys:
            try:
                self._believe(content, _signature_of(path, raw))
            except ValueError as fault:
                raise UntrustedFileError(f"{path}: {fault}: {COMMAND} {path.name}") from None
        return content

    def _believe(self, content: bytes, signature: str) -> None:
        key, hash_name, signed = _taken_apart(signature)
        if key not in self.keys:
            trusted = " or ".join(known.fingerprint for known in self.keys)
            raise ValueError(f"signed by {key.fingerprint}, trusted is {trusted} alone; sign it with that key")
        try:
            VerifyKey(key.point).verify(to_be_signed(content, hash_name), signed)
        except BadSignatureError:
            raise ValueError("changed after it was signed; restore it, or sign it anew where the key is") from None


def load_public_keys(path: Path) -> tuple[str, ...]:
    """Lines of a file of public keys, at least one; lines with # are comments. Raises ConfigurationError."""
    try:
        lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
    except (OSError, UnicodeDecodeError) as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault}") from None
    keys = {number: line for number, line in enumerate(lines, 1) if line and not line.startswith("#")}
    for number, line in keys.items():
        try:
            PublicKey.of(line)
        except ValueError as fault:
            raise ConfigurationError(f"{path}, line {number}: {fault}") from None
    if not keys:
        raise ConfigurationError(f"{path}: holds no public key: write a line of KEY.pub there")
    return tuple(keys.values())


def pinned_by(path: Path | None) -> Trust:
    """Trust in the public keys of a file; without a file every file is trusted. Raises ConfigurationError."""
    return Trust(tuple(map(PublicKey.of, load_public_keys(path)))) if path else Trust()


def to_be_signed(content: bytes, hash_name: str) -> bytes:
    """The message that the key signs, which contains the hash of the content."""
    digest = hashlib.new(hash_name, content).digest()
    return MAGIC + b"".join(map(_string, (NAMESPACE, b"", hash_name.encode(), digest)))


def armoured(key: PublicKey, hash_name: str, signed: bytes) -> str:
    """The text of a signature file for the 64 bytes ``signed``."""
    inner = _string(KEY_TYPE) + _string(signed)
    blob = MAGIC + VERSION + b"".join(map(_string, (key.blob, NAMESPACE, b"", hash_name.encode(), inner)))
    return BEGIN + "\n".join(textwrap.wrap(base64.b64encode(blob).decode(), COLUMNS)) + END


def signature_path(path: Path) -> Path:
    return path.with_name(path.name + SUFFIX)


def _signature_of(path: Path, raw: Read) -> str:
    beside = signature_path(path)
    try:
        return raw(beside)[:MOST_BYTES].decode("ascii")
    except FileNotFoundError:
        raise ValueError(f"not signed, there is no {beside.name}; sign it where the key is") from None
    except UnicodeDecodeError:
        raise ValueError(NO_SIGNATURE) from None
    except OSError as fault:
        raise ValueError(f"{beside.name} cannot be read ({fault.strerror}); mend that or sign it anew") from None


def _taken_apart(signature: str) -> tuple[PublicKey, str, bytes]:
    """Key, hash name and the 64 bytes of a signature. Raises ValueError if ssh-keygen did not write it."""
    try:
        blob = base64.b64decode("".join(signature.removeprefix(BEGIN).removesuffix(END).split()), validate=True)
        start = len(MAGIC) + len(VERSION) + len(_string(b""))
        key = PublicKey(blob[start : start + len(_string(KEY_TYPE)) + len(_string(bytes(KEY_BYTES)))])
        signed = blob[-SIGNATURE_BYTES:]
        hash_name = next(name for name in HASHES if armoured(key, name, signed) == signature)
    except (binascii.Error, ValueError, StopIteration):
        raise ValueError(NO_SIGNATURE) from None
    return key, hash_name, signed
