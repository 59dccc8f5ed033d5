"""Ways to break any file: bytes cut, flipped, overwritten, spliced, repeated, swapped or nested."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Random = np.random.Generator
ODD_WORDS = (
    b"nan inf -inf 1e308 -1e308 1e-320 -1 0 99999999999999999999 2147483647 90 180.00001 0,5 x 1_0 0x10 1e --1 360 "
    b"89.9999999 \xd9\xa3"
).split(b" ")


def _cut(content: bytes, others: list[bytes], random: Random) -> bytes:
    return content[: int(random.integers(len(content) + 1))]


def _flip(content: bytes, others: list[bytes], random: Random) -> bytes:
    broken = bytearray(content)
    for at in random.integers(0, max(len(broken), 1), int(random.integers(1, 8))):
        if at < len(broken):
            broken[at] ^= 1 << int(random.integers(8))
    return bytes(broken)


def _overwrite(content: bytes, others: list[bytes], random: Random) -> bytes:
    at = _place(content, random)
    patch = random.bytes(int(random.integers(1, 9)))
    return content[:at] + patch + content[at + len(patch) :]


def _huge(content: bytes, others: list[bytes], random: Random) -> bytes:
    """A binary number replaced by an extreme or odd value."""
    values = (b"\xff" * 8, b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0" * 8, b"\xff" * 7 + b"\x7f", b"\0\0\xc0\x7f" * 2,
              b"\0\0\x80\x7f" * 2, b"\0" * 6 + b"\xf0\x7f", b"\1")  # fmt: skip
    value = values[int(random.integers(len(values)))]
    at = _place(content, random)
    return content[:at] + value + content[at + len(value) :]


def _number(content: bytes, others: list[bytes], random: Random) -> bytes:
    """A word of text replaced by an impossible number, or removed."""
    value = ODD_WORDS[int(random.integers(len(ODD_WORDS)))]
    found = [m for m in range(len(content)) if content[m : m + 1].isdigit()]
    if not found:
        return content
    at = found[min(int(random.exponential(len(found) / 4)), len(found) - 1)]
    begin = end = at
    while begin > 0 and content[begin - 1 : begin] not in (b" ", b"\t", b"\n", b",", b";", b">", b"{"):
        begin -= 1
    while end < len(content) and content[end : end + 1] not in (b" ", b"\t", b"\n", b",", b";", b"<", b"}"):
        end += 1
    return content[:begin] + value + content[end:]


def _splice(content: bytes, others: list[bytes], random: Random) -> bytes:
    other = others[int(random.integers(len(others)))]
    return content[: int(random.integers(len(content) + 1))] + other[int(random.integers(len(other) + 1)) :]


def _repeat(content: bytes, others: list[bytes], random: Random) -> bytes:
    a, b = sorted(random.integers(0, len(content) + 1, 2))
    return content[:b] + content[a:b] * int(random.integers(1, 20)) + content[b:]


def _remove(content: bytes, others: list[bytes], random: Random) -> bytes:
    a = int(random.integers(len(content) + 1))
    return content[:a] + content[a + int(random.integers(1, 200)) :]


def _lines(content: bytes, others: list[bytes], random: Random) -> bytes:
    """Lines dropped, doubled or in another order."""
    lines = content.split(b"\n")
    at, to = random.integers(0, len(lines), 2)
    way = int(random.integers(3))
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(int(to), lines[at])
    else:
        lines[at], lines[to] = lines[to], lines[at]
    return b"\n".join(lines)


def _swap(content: bytes, others: list[bytes], random: Random) -> bytes:
    """The byte order of the rest swapped."""
    size, at = int(random.choice([2, 4, 8])), int(random.choice([0, 12, _place(content, random)]))
    body = content[at : at + (len(content) - at) // size * size]
    return content[:at] + np.frombuffer(body, f"<u{size}").byteswap().tobytes() + content[at + len(body) :]


def _nest(content: bytes, others: list[bytes], random: Random) -> bytes:
    """Brackets and elements nested very deeply."""
    at, depth = _place(content, random), int(random.choice([10, 1000, 20000]))
    opening = (b"{", b"<a>", b"<Layer>", b"(", b"<!--", b"<![CDATA[", b"&amp;")[int(random.integers(7))]
    return content[:at] + opening * depth + content[at:]


def _encoding(content: bytes, others: list[bytes], random: Random) -> bytes:
    way = int(random.integers(5))
    if way == 0:
        return b"\xef\xbb\xbf" + content
    if way == 1:
        return content.replace(b"\n", b"\r")
    if way == 2:
        return content.replace(b".", b",")
    if way == 3:
        return content.decode("latin-1").encode("utf-16")
    return content.replace(b"\n", b"\0\n", 3)


WAYS: tuple[Callable[[bytes, list[bytes], Random], bytes], ...] = (
    _cut, _flip, _overwrite, _huge, _number, _number, _number, _splice, _repeat, _remove, _lines, _lines, _swap, _nest,
    _encoding,
)  # fmt: skip


def _place(content: bytes, random: Random) -> int:
    """A place in `content`, more often near its beginning."""
    limit = (16, 200, len(content))[int(random.integers(3))]
    return int(random.integers(0, max(min(limit, len(content)), 1)))
