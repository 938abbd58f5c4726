"""Text as tools write it: UTF-8, or the cp1252 of western Windows, with or without a byte order mark."""

import codecs
from typing import Final

OR_CP1252: Final = "springscale-or-cp1252"
"""Error handler: bytes that are no UTF-8 are read as cp1252."""


def _as_cp1252(fault: UnicodeError) -> tuple[str, int]:
    if not isinstance(fault, UnicodeDecodeError):
        raise fault
    return fault.object[fault.start : fault.end].decode("cp1252", errors="replace"), fault.end


codecs.register_error(OR_CP1252, _as_cp1252)


def text_of(content: bytes) -> str:
    """The text of a file; a byte order mark is skipped, and tells UTF-16. Line ends become ``\\n``."""
    is_utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = content.decode("utf-16", "replace") if is_utf_16 else content.decode("utf-8-sig", OR_CP1252)
    return text.replace("\r\n", "\n").replace("\r", "\n")
