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
    """The text of a file; a byte order mark is skipped. It tells UTF-16, as does half of a first character. Line ends
    become ``\\n``.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = content.decode("utf-16", "replace")
    elif 0 in content[:2]:
        text = content.decode("utf-16-le" if content[0] else "utf-16-be", "replace")
    else:
        text = content.decode("utf-8-sig", OR_CP1252)
    return text.replace("\r\n", "\n").replace("\r", "\n")
