"""The edited material: its steps of undo, its origins, and the material B to compare with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal, cast, get_args

from lambent.materials.document import Kind, Lobe, Material
from lambent.viewer.editor.restrictions import Kept, Restrictions
from lambent.viewer.edits.edits import MaterialEdits

B = Literal["nothing", "as loaded", "as saved", "before the last edit", "a document"]
REFERENCES: tuple[B, ...] = get_args(B)


@dataclass
class Subject:
    """The material `name` of `edits`; undo is shared by the whole window."""

    edits: MaterialEdits
    name: str
    reference: B = "nothing"  # the choice of the material B
    document: Material | None = None

    def __post_init__(self) -> None:
        self.loaded = self.material
        self._restrictions = Restrictions(keep=partial(self.edits.keep_note, self.name))
        self._origins = [self.loaded]  # materials as loaded or fitted, with their provenance

    @property
    def material(self) -> Material:
        return self.edits.current(self.name)

    @property
    def restrictions(self) -> Restrictions:
        """Restrictions of the material's parameters in a fit; every change is a step of undo."""
        kept = cast(Kept | None, self.edits.note_of(self.name))
        self._restrictions.restore(kept or (frozenset(), ()))
        return self._restrictions

    @property
    def compared(self) -> Material | None:
        """The material B, if any."""
        found = {
            "as loaded": self.loaded,
            "as saved": self.edits.saved.get(self.name),
            "before the last edit": self.edits.previous(self.name),
            "a document": self.document,
        }
        return found.get(self.reference)

    @property
    def origin(self) -> Material:
        """The material as it was loaded or fitted; its provenance, which edits keep, tells."""
        about = self.material.provenance
        return next((found for found in reversed(self._origins) if found.provenance == about), self.loaded)

    @property
    def unsaved(self) -> bool:
        """Whether the material has unsaved changes."""
        kept, now = self.edits.saved.get(self.name, self.loaded), self.material
        return now.name != kept.name or not same_numbers(now, kept)

    def change(self, material: Material) -> None:
        """Change the material within the present stroke."""
        self.edits.change(self.name, material)

    def step(self, material: Material) -> None:
        """Change the material as one step of undo."""
        self.edits.end_stroke()
        self.change(material)
        self.edits.end_stroke()

    def adopt(self, material: Material) -> None:
        """Take a material with its own provenance, as one step of undo."""
        self._origins.append(material)
        self.step(material)

    def compare_with(self, document: Material) -> None:
        """Compare with a document from now on."""
        self.document, self.reference = document, "a document"
        self._origins.append(document)

    def add_lobe(self, kind: Kind) -> None:
        r0 = {"reflection": 0.04, "transmission": 0.0, "retro": 1.0}[kind]
        lobe = Lobe(k=(0.5, 0.5, 0.5), mx=0.2, my=0.2, r0=(r0,) * 3).of_kind(kind)
        self.step(self.material.model_copy(update={"lobes": (*self.material.lobes, lobe)}))

    def remove_lobe(self, index: int) -> None:
        lobes = self.material.lobes
        kept = [i for i in range(len(lobes)) if i != index]
        self._with_lobes(tuple(lobes[i] for i in kept), kept)

    def turn_lobe(self, index: int, kind: Kind) -> None:
        """Change the kind of a lobe, and drop its restrictions."""
        lobes = list(self.material.lobes)
        lobes[index] = lobes[index].of_kind(kind)
        self._with_lobes(tuple(lobes), [i if i != index else -1 for i in range(len(lobes))])

    def _with_lobes(self, lobes: tuple[Lobe, ...], kept: list[int]) -> None:
        after = self.material.model_copy(update={"lobes": lobes})
        restrictions, before = self.restrictions, self.material
        self.edits.end_stroke()
        self.change(after)
        restrictions.follow(before, after, kept)
        self.edits.end_stroke()


def same_numbers(a: Material, b: Material) -> bool:
    """Whether two materials scatter alike, whatever their names and provenance."""
    return a.model_copy(update={"name": b.name, "provenance": b.provenance}) == b
