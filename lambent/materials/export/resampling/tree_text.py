"""A tensor tree as the text of BSDF files: nested braces, see measured/tensor_tree.py."""

from __future__ import annotations

from collections.abc import Iterator

from lambent.materials.measured.parts.tensor_tree import TensorTree

_PER_LINE, _AT_ONCE = 8, 1 << 14  # values per line and per piece of text, at most


def pieces_of(tree: TensorTree, digits: int) -> Iterator[str]:
    """The text in small pieces, with `digits` significant digits."""
    stack: list[int | None] = [tree.root]  # None closes a brace
    while stack:
        code = stack.pop()
        if code is None:
            yield "}\n"
        elif code >= 0:
            yield "{\n"
            stack += [None, *reversed(tree.children[code].tolist())]
        else:
            yield from _grid(tree, -1 - code, digits)


def _grid(tree: TensorTree, number: int, digits: int) -> Iterator[str]:
    start = int(tree.starts[number])
    end = start + (1 << tree.rank * int(tree.logs[number]))
    yield "{ "
    for at in range(start, end, _AT_ONCE):
        words = [f"{v:.{digits}g}" for v in tree.values[at : min(at + _AT_ONCE, end)].tolist()]
        yield "\n".join(" ".join(words[k : k + _PER_LINE]) for k in range(0, len(words), _PER_LINE))
        yield "\n" if at + _AT_ONCE < end else " "
    yield "}\n"
