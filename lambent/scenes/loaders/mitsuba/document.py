"""Mitsuba's XML as a tree: parameters substituted, other files included, names of version 0.6 converted to those of 3.

The file is untrusted. Document type declarations, and with them entities, are refused; the number of elements, their
depth, the included files and the length of parameters are limited.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from lambent.core.ceilings import MITSUBA_BYTES, XML_ELEMENTS, XML_FILES, XML_LEVELS, XML_TEXT
from lambent.core.errors import UserError, did_you_mean
from lambent.core.geometry.directions import Floats
from lambent.scenes.loaders.scene_files import SceneFiles

ABSURD = 1e30
OLD_TAGS = {"camera": "sensor", "luminaire": "emitter", "lookAt": "lookat"}
_PARAMETER = re.compile(r"\$(\w+)")
_SCENE = re.compile(rb"(?:\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>)*<scene[\s>/]", re.DOTALL)
_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


@dataclass
class Element:
    """A tag with its attributes; `name` is the attribute of that name, as version 3 spells it."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    children: list[Element] = field(default_factory=list)

    @property
    def name(self) -> str:
        return snake(self.attributes.get("name", ""))

    @property
    def id(self) -> str | None:
        return self.attributes.get("id")

    @property
    def type(self) -> str:
        return self.attributes.get("type", "").lower()

    def floats(self, count: int | None = None, attribute: str = "value") -> list[float]:
        """Finite numbers of an attribute, separated by blanks or commas; exactly `count`, if given."""
        text = self.attributes.get(attribute, "")
        try:
            values = [float(word) for word in text.replace(",", " ").split()]
        except ValueError as error:
            raise self.error("not a number", got=text) from error
        if not all(abs(v) < ABSURD for v in values):
            raise self.error("not a finite number", got=text)
        if count is not None and len(values) != count:
            raise self.error("wrong count of numbers", got=text or "nothing", expected=count)
        return values

    def vector(self, default: float = 0.0) -> Floats:
        """(3,) of the attributes x, y, z or of a value; a single number stands for all three."""
        if "value" not in self.attributes:
            return np.array([self.floats(1, c)[0] if c in self.attributes else default for c in "xyz"])
        values = self.floats()
        if len(values) not in (1, 3):
            raise self.error("wrong count of numbers", got=len(values), expected="1 or 3")
        return np.array(values * 3 if len(values) == 1 else values)

    @property
    def place(self) -> str:
        what = self.attributes.get("name") or self.attributes.get("id") or self.attributes.get("type") or ""
        return f"line {self.line} <{self.tag}> {what}".rstrip()

    def error(self, message: str, *, got: object = None, expected: object = None, hint: str | None = None) -> UserError:
        return UserError(message, file=self.file, field=self.place, got=got, expected=expected, hint=hint)


@dataclass
class Document:
    """A scene file with its includes; `ids` are the elements by id, `files` its source files."""

    is_old: bool  # version 0.6 or earlier
    elements: list[Element]
    ids: dict[str, Element]
    files: SceneFiles


def snake(name: str) -> str:
    """The version 3 name of a parameter of version 0.6: toWorld -> to_world."""
    return _HUMP.sub("_", name).lower()


def is_scene(head: bytes) -> bool:
    """Whether a file that begins with `head` is a Mitsuba scene."""
    return _SCENE.match(head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe")) is not None


def read(path: Path, files: SceneFiles) -> Document:
    """Read the document of a file.

    Raises
    ------
    UserError
        If it is not XML or not a scene, refers to missing files, or uses parameters that are not set.
    """
    parser = _Parser(files)
    scene = parser.scene(path)
    parameters = parser.parameters
    ids: dict[str, Element] = {}
    stack = list(scene.children)
    while stack:
        element = stack.pop()
        element.attributes = {k: _filled(v, parameters, element) for k, v in element.attributes.items()}
        if element.id is not None and element.tag not in ("ref", "alias"):
            if element.id in ids:
                raise element.error("id is used twice", got=element.id)
            ids[element.id] = element
        stack += element.children
    for element in scene.children:
        if element.tag == "alias":
            wanted, new = element.id or "", element.attributes.get("as", "")
            if wanted not in ids:
                raise element.error("unknown id", got=wanted, hint=did_you_mean(wanted, ids))
            ids[new] = ids[wanted]
    return Document(scene.attributes.get("version", "").startswith("0."), scene.children, ids, files)


def _filled(text: str, parameters: dict[str, str], element: Element) -> str:
    """`text` with its $parameters substituted; the longest known name matches."""
    if "$" not in text:
        return text

    def value(match: re.Match[str]) -> str:
        word = match[1]
        for end in range(len(word), 0, -1):
            if word[:end] in parameters:
                return parameters[word[:end]] + word[end:]
        hint = did_you_mean(word, parameters) or f'add <default name="{word}" value="..."/>'
        raise element.error("parameter is not set", got=f"${word}", hint=hint)

    filled = _PARAMETER.sub(value, text)
    XML_TEXT.check(len(filled), file=element.file, field=element.place)
    return filled


class _Parser:
    """Reads a scene file and its includes."""

    def __init__(self, files: SceneFiles) -> None:
        self.parameters: dict[str, str] = {}
        self._files, self._count, self._elements = files, 0, 0
        self._open: list[Path] = []

    def scene(self, path: Path) -> Element:
        if path in self._open:
            raise UserError("includes itself", file=path)
        self._count += 1
        XML_FILES.check(self._count, file=path)
        self._open.append(path)
        scene = self._parse(path)
        children: list[Element] = []
        for element in scene.children:
            if element.tag == "default":
                self.parameters.setdefault(element.attributes.get("name", ""), element.attributes.get("value", ""))
            elif element.tag == "include":
                name = _filled(element.attributes.get("filename", ""), self.parameters, element)
                children += self.scene(self._files.path(name, path, f"line {element.line} <include>")).children
            elif element.tag != "path":
                children.append(element)
        scene.children = children
        self._open.pop()
        return scene

    def _parse(self, path: Path) -> Element:
        top = Element("", {}, path, 0)
        stack = [top]
        parser = expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            self._elements += 1
            for ceiling, found in ((XML_ELEMENTS, self._elements), (XML_LEVELS, len(stack))):
                ceiling.check(found, file=path, field=f"line {parser.CurrentLineNumber}")
            element = Element(OLD_TAGS.get(tag, tag), attributes, path, parser.CurrentLineNumber)
            stack[-1].children.append(element)
            stack.append(element)

        def refuse(*_: object) -> None:
            raise UserError("document type declarations are not supported", file=path, hint="remove the <!DOCTYPE ...>")

        parser.StartElementHandler = start
        parser.EndElementHandler = lambda _: stack.pop()
        parser.StartDoctypeDeclHandler = refuse
        try:
            parser.Parse(self._files.read(path, MITSUBA_BYTES), True)
        except (expat.ExpatError, LookupError, ValueError) as error:  # LookupError: an unknown encoding
            raise UserError(f"not XML ({error})", file=path) from error
        if not top.children or top.children[0].tag != "scene":
            got = f"<{top.children[0].tag}>" if top.children else "nothing"
            raise UserError("not a Mitsuba scene", file=path, got=got, expected="<scene>")
        return top.children[0]
