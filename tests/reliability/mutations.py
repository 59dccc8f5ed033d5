"""Ways to break a sound file: bytes, words, and the structure of JSON, XML, TOML and containers.

`mutate` applies one to three of them.
"""

from __future__ import annotations

import json
import re
import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Callable
from typing import Any

from tests.reliability.byte_mutations import WAYS as OF_BYTES
from tests.reliability.byte_mutations import Random

LARGEST_BYTES = 200_000
DIGITS = "9" * 5000
ODD_JSON = (
    "Infinity", "-Infinity", "NaN", "1e308", "-1e308", "1e999", "1e-320", "-1", "0", "-0.0", "1.5", "true", "null",
    "4294967296", "9007199254740993", "18446744073709551616", "9" * 400, DIGITS, '""', '"a"', '"../x"', '"/dev/zero"',
    '"\\ud800"', '"\\u0000"', '"<script>"', '"' + "n" * 5000 + '"', "[]", "{}", "[[[[]]]]", "[" * 2000 + "]" * 2000,
    "[0,0,0]", "[1e200,1e200,1e200]", '"data:;base64,AAAA"', '"data:image/png;base64,iVBORw0KGgo="', '"p.png"',
)  # fmt: skip
ODD_TEXT = (
    b"inf", b"-inf", b"nan", b"1e308", b"-1e308", b"1e-320", b"-1", b"0", b"1e999", b"4294967295", b"2147483648",
    b"99999999999999999999", DIGITS.encode(), b"0x10", b"1_0", b"1e", b"--1", b"0,5", b"\xd9\xa3", b"'\\ud800'", b"''",
    b"[]", b"{}", b"true", b"../x", b"/dev/zero", b"\xff\xfe", b"$x", b"&lt;", b"*", b"?", b"[[[[[[[[", b"a.b.c.d",
)  # fmt: skip
_WORD = re.compile(rb"[^\s,;=<>\"'{}\[\]()/]+")


def mutate(content: bytes, others: list[bytes], random: Random) -> bytes:
    """`content` after one to three mutations, at most `LARGEST_BYTES` long; `others` are sound files to splice with."""
    for _ in range(int(random.integers(1, 4))):
        if random.random() < 0.5 and (way := structural(content)) is not None:
            content = way(content, random)[:LARGEST_BYTES]
        elif random.random() < 0.3:
            content = words(content, random)[:LARGEST_BYTES]
        else:
            content = OF_BYTES[int(random.integers(len(OF_BYTES)))](content, others, random)[:LARGEST_BYTES]
    return content


def structural(content: bytes) -> Callable[[bytes, Random], bytes] | None:
    """The way that knows the structure of a file; None where it has none that is known."""
    head = content[:200].lstrip()
    if content.startswith(b"glTF"):
        return glb
    if content.startswith(b"\x89PNG"):
        return png
    if head.startswith((b"{", b"[")) and b'"' in content:
        return of_json
    if head.startswith(b"<"):
        return xml
    return toml if b"\n[" in content and b" = " in content else None


def words(content: bytes, random: Random) -> bytes:
    """A word of a text replaced by an odd one, or by another word of the file."""
    found = [m.span() for m in _WORD.finditer(content[:50_000])]
    if not found:
        return content
    begin, end = found[int(random.integers(len(found)))]
    other = found[int(random.integers(len(found)))]
    new = ODD_TEXT[int(random.integers(len(ODD_TEXT)))] if random.random() < 0.7 else content[slice(*other)]
    return content[:begin] + new + content[end:]


def of_json(content: bytes, random: Random) -> bytes:
    """A value of the document replaced, removed, doubled or swapped with another."""
    try:
        document = json.loads(content)
        places = list(_places(document))
    except (ValueError, RecursionError):
        return content
    if not places:
        return content
    holder, key = places[int(random.integers(len(places)))]
    other_holder, other_key = places[int(random.integers(len(places)))]
    way, odd = int(random.integers(6)), None
    if way == 0:
        del holder[key]
    elif way == 1 and isinstance(holder, list):
        holder.extend([holder[key]] * int(random.choice([1, 3, 300])))
    elif way == 2:
        holder[key] = json.loads(json.dumps(other_holder[other_key]))
    elif way == 3 and isinstance(holder[key], int | float) and abs(holder[key]) < 1e300:  # a float has no more
        holder[key] = holder[key] * random.choice([-1, 2, 0.5, 1000, 1e9]) + random.choice([0, 1, -1])
    else:
        odd, holder[key] = ODD_JSON[int(random.integers(len(ODD_JSON)))], "ODD VALUE"
    text = json.dumps(document)
    return (text if odd is None else text.replace('"ODD VALUE"', odd, 1)).encode()


def _places(value: Any) -> Any:
    """(holder, key) of every value within a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield value, key
        yield from _places(inner)


def xml(content: bytes, random: Random) -> bytes:
    """An element removed, doubled, moved or nested in itself, or an attribute changed; or entities declared."""
    if random.random() < 0.1:
        kinds = (
            b'<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>',
            b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>', b"<?xml version='1.0' encoding='utf-7'?>",
            b"<?xml version='1.0' encoding='nonsense'?>", b"<?xml version='1.0' encoding='utf-32'?>",
        )  # fmt: skip
        return kinds[int(random.integers(len(kinds)))] + content
    try:
        root = ET.fromstring(content)
    except (ET.ParseError, ValueError, LookupError):
        return content
    parents = [e for e in root.iter() if len(e)]
    if not parents:
        return content
    parent = parents[int(random.integers(len(parents)))]
    at = int(random.integers(len(parent)))
    child, way = parent[at], int(random.integers(6))
    if way == 0:
        parent.remove(child)
    elif way == 1:
        parent.extend([child] * int(random.choice([1, 3, 100])))
    elif way == 2:
        root.append(child)
    elif way == 3:
        child.append(ET.fromstring(ET.tostring(child)))
    elif way == 4 and child.attrib:
        name = list(child.attrib)[int(random.integers(len(child.attrib)))]
        odd = ODD_TEXT[int(random.integers(len(ODD_TEXT)))]
        child.set(name, odd.decode("latin-1").replace("\0", ""))
    else:
        child.text = ODD_TEXT[int(random.integers(len(ODD_TEXT)))].decode("latin-1")
    return ET.tostring(root)


def toml(content: bytes, random: Random) -> bytes:
    """The value of a key replaced, or a line moved to another section."""
    lines = content.split(b"\n")
    keyed = [i for i, line in enumerate(lines) if b" = " in line]
    at = keyed[int(random.integers(len(keyed)))]
    key, _, value = lines[at].partition(b" = ")
    way = int(random.integers(3))
    if way == 0:
        odd = ODD_JSON[int(random.integers(len(ODD_JSON)))].encode()
        lines[at] = key + b" = " + odd.replace(b"Infinity", b"inf").replace(b"NaN", b"nan")
    elif way == 1:
        numbers = list(re.finditer(rb"[-\d.]+", value))
        if numbers:
            begin, end = numbers[int(random.integers(len(numbers)))].span()
            new = ODD_TEXT[int(random.integers(len(ODD_TEXT)))]
            lines[at] = key + b" = " + value[:begin] + new + value[end:]
    else:
        lines.insert(int(random.integers(len(lines))), lines[at])
    return b"\n".join(lines)


def glb(content: bytes, random: Random) -> bytes:
    """The JSON of a GLB changed, and packed again with true lengths."""
    if len(content) < 20:
        return content
    length = struct.unpack_from("<I", content, 12)[0]
    text, rest = content[20 : 20 + length], content[20 + length :]
    text = of_json(text, random) if random.random() < 0.8 else words(text, random)
    text += b" " * (-len(text) % 4)
    return content[:8] + struct.pack("<III", 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def png(content: bytes, random: Random) -> bytes:
    """A chunk of a PNG changed, removed or doubled, with true checksums."""
    chunks, at = [], 8
    while at + 12 <= len(content):
        length = struct.unpack_from(">I", content, at)[0]
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return content
    i = int(random.integers(len(chunks)))
    kind, data = chunks[i]
    way = int(random.integers(4))
    if way == 0:
        del chunks[i]
    elif way == 1:
        chunks.insert(i, (kind, data))
    elif data:
        broken = bytearray(data)
        for _ in range(int(random.integers(1, 4))):
            broken[int(random.integers(len(broken)))] = int(random.choice([0, 1, 3, 16, 127, 255]))
        chunks[i] = kind, bytes(broken)
    return content[:8] + b"".join(
        struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks
    )
