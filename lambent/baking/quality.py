"""The effort of a bake. Each kind of artefact has its own settings for every quality."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

from lambent.core.discovery import known

MAX_DEPTH = 64  # surfaces on the longest path, mirrors included; in a white room (albedo .9), 16 lose 9 % of the light


class QualityName(StrEnum):
    """Qualities; every kind of artefact has settings for each, but a draft changes those of a preview."""

    draft = "draft"
    preview = "preview"
    normal = "normal"
    final = "final"


@dataclass(frozen=True)
class Quality:
    """The settings of a named quality, with changes.

    The store records `name`; `changes` maps kinds of artefacts to new values of their settings' fields.
    """

    name: str
    base: QualityName = QualityName.preview
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def changed(self, name: str | None = None, /, **changes: Mapping[str, Any]) -> Quality:
        """A copy with other values, by kind: `changed("draft", probe={"texels": 64})`."""
        merged = {**self.changes, **{kind: {**self.changes.get(kind, {}), **new} for kind, new in changes.items()}}
        return Quality(name or self.name, self.base, merged)

    def settings(self, kind: str, by_quality: Mapping[Any, Any]) -> Any:
        """Settings of a kind of artefact, a dataclass, chosen from `by_quality` and changed."""
        return replace(by_quality[self.base], **self.changes.get(kind, {}))


DRAFT = Quality(QualityName.draft).changed(
    geometry={"texels": 192},
    light_map={"samples": (16, 16), "noise": 0.5, "gather_samples": 64},
    environment={"texels": 128},
    probe={"texels": 64, "samples": 8},
)


def quality_named(name: str | Quality) -> Quality:
    """The quality of this name; a `Quality` is returned unchanged."""
    if isinstance(name, Quality):
        return name
    found = QualityName(known("quality", name, list(QualityName)))
    return DRAFT if found is QualityName.draft else Quality(name, found)
