"""A scene.toml as text."""

from __future__ import annotations

import json


def toml_of(document):
    """The text of {key: value}: plain values first, then a table for each mapping, and for each item of a list of them.

    Mappings in tables are inline. Numbers have ten digits: far from the origin, targets differ little from positions.
    """
    plain = {key: value for key, value in document.items() if not _is_tables(value)}
    parts = ["".join(f"{_key(key)} = {_value(value)}\n" for key, value in plain.items())]
    for key, value in document.items():
        if isinstance(value, dict) and value:
            parts.append(f"[{_key(key)}]\n" + _lines(value))
        elif _is_tables(value):
            parts += [f"[[{_key(key)}]]\n" + _lines(one) for one in value]
    return "\n".join(parts)


def _is_tables(value):
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _lines(table):
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def _key(key):
    return key if key.isascii() and key.replace("_", "a").isalnum() else _text(key)


def _text(value):
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value):
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(f"{value:.10g}"))
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return str(value)
