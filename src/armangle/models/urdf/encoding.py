"""Decodes the bytes of an XML text for a parser, whatever its encoding."""

from __future__ import annotations

import codecs
import re

_DECLARED = re.compile(rb"<\?xml[^>]{0,100}?encoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})")
_WIDE = (
    "gbk",
    "gb2312",
    "gb18030",
    "hz",
    "big5",
    "big5hkscs",
    "shift_jis",
    "cp932",
    "euc_jp",
    "euc_kr",
    "cp949",
)


def decoded(text: bytes) -> tuple[bytes | str, str]:
    r"""Return an XML text, decoded if its parser cannot do it, and a note about changed characters.

    Makers write comments in the encoding of their editors. A text without a declared encoding is UTF-8: other
    bytes are read as \x and their number, so that names stay distinct. Encodings of several bytes are
    decoded, since expat lacks them.
    """
    declared = _DECLARED.match(text)
    name = declared[1].decode("ascii") if declared else "utf-8"
    try:
        codec = codecs.lookup(name).name
    except LookupError:
        return text, ""  # the parser reports it
    if codec not in ("utf-8", "ascii", *_WIDE) or text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return text, ""
    codec = "utf-8" if codec == "ascii" else codec
    try:
        found = text.decode(codec)
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        return text.decode(
            codec, "backslashreplace"
        ), f"line {line} is not in the encoding {name}: read as bytes"
    return (text if codec == "utf-8" else found), ""
