"""The state of the walk mode, in parts. Panels and input read and write it; the drawing shows it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lambent.core.plain import Triple, plain_name, triple
from lambent.store.contract import ObjectRecord, SceneRecord, whole_objects
from lambent.viewer.cameras.navigation import Movement, Navigation
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.files import with_account, write_document
from lambent.viewer.edits.edits import MaterialEdits, rescue
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.look import Look
from lambent.viewer.mode import Divider
from lambent.viewer.modes.walk.comparison import Comparison
from lambent.viewer.modes.walk.light.answering import Answering
from lambent.viewer.modes.walk.light.lamps import Lamps
from lambent.viewer.modes.walk.light.light_fields import FieldView
from lambent.viewer.modes.walk.light.lights import Lights
from lambent.viewer.modes.walk.light.metering import Meter
from lambent.viewer.modes.walk.markers import Marks
from lambent.viewer.modes.walk.rebake.rebaked import Rebaking
from lambent.viewer.modes.walk.session.states import States
from lambent.viewer.modes.walk.session.texturing import Texturing
from lambent.viewer.modes.walk.views.filming import Films
from lambent.viewer.modes.walk.views.recording import Recordings
from lambent.viewer.modes.walk.views.views import SavedViews
from lambent.viewer.screen import Screen


@dataclass
class Selection:
    """The selected object `name`: whole, even if the bake has cut it into parts."""

    objects: tuple[ObjectRecord, ...]
    name: str | None = None
    pointed: Triple | None = None  # the clicked point, if it is the centre of orbit instead of the object's middle

    def choose(self, name: str | None, pointed: Triple | None = None) -> None:
        self.name, self.pointed = name, pointed

    @property
    def record(self) -> ObjectRecord | None:
        return next((item for item in self.objects if item.name == self.name), None)

    @property
    def pivot(self) -> Triple | None:
        """Centre of orbit: the middle of the object, or the clicked point."""
        found = self.record
        return self.pointed if found is None or self.pointed else triple(np.mean(found.bounds, axis=0))

    @property
    def material(self) -> str | None:
        """Name of the selected object's material."""
        return None if self.record is None else self.record.material


@dataclass
class Materials:
    """Edits of the scene's materials, their files, and an open editor, if any."""

    edits: MaterialEdits
    screen: Screen
    file_names: dict[str, str] = field(default_factory=dict)  # typed file name by material
    linked_roughness: bool = True  # mx and my keep their ratio
    typed_measurement: str = ""  # path of a file to compare the selected material with
    editor: Editor | None = None
    may_replace: set[Path] = field(default_factory=set)  # files written here, or confirmed by saving twice

    def file_name(self, material: str) -> str:
        """File name of a saved material: as typed, else from its name."""
        return self.file_names.get(material, f"{plain_name(material)}.json")

    def save(self, name: str) -> None:
        """Write the material into the screen's folder, and report success or failure.

        Its provenance stays, with a note if numbers were changed by hand.
        """
        material, origin = self.edits.current(name), self.edits.scene[name]
        if write_document(
            lambda: with_account(material, origin, None, {}),
            self.screen,
            self.file_name(name),
            self.may_replace,
            bare=True,
        ):
            self.edits.saved[name] = material

    def rescue(self, names: Iterable[str]) -> Iterator[Path]:
        """Write materials to new files."""
        return rescue(self.edits, names, self.screen.folder)

    def open_editor(self, name: str, file: str = "") -> None:
        """Open the editor on a material, and in it a file, or the measurement whose path was typed, if any."""
        self.close_editor()
        self.editor = Editor(self.edits, name, self.screen)
        self.editor.files.name, self.editor.leave = self.file_name(name), self.close_editor
        if wanted := file or self.typed_measurement.strip():
            self.editor.files.open(wanted)

    def close_editor(self) -> None:
        """Close the editor; the material stays as it is."""
        if self.editor is not None:
            self.editor.close()
        self.editor = None


@dataclass
class WalkState:
    """Loosely coupled parts of the state; a panel takes the parts that it needs."""

    scene: SceneRecord
    screen: Screen
    look: Look
    navigation: Navigation
    selection: Selection
    materials: Materials
    recordings: Recordings
    marks: Marks
    session: SessionKeeper
    states: States
    texturing: Texturing
    comparison: Comparison = field(default_factory=Comparison)
    meter: Meter = field(default_factory=Meter)
    answering: Answering = field(default_factory=Answering)
    rebaking: Rebaking = field(default_factory=Rebaking)
    films: Films = field(default_factory=Films)
    fields: FieldView = field(default_factory=FieldView)
    lights: Lights = field(default_factory=Lights)
    lamps: Lamps = field(default_factory=Lamps)
    store: Path | None = None  # folder of the store
    sky_turn_deg: float = 0.0  # rotation of the sky, as opened
    replaced: tuple[str, ...] = ()  # replacement meshes, as `scenes.replacement` reads them
    store_name: str = "STORE"
    missing: tuple[str, ...] = ()  # lines on arrays that the store lacks
    notes: tuple[str, ...] = ()  # lines on the light map
    knows_noise: bool = False  # whether the store has the noise of its light map

    @property
    def selected_parts(self) -> frozenset[str]:
        """Parts of the selected object if the bake has cut it, else its name."""
        name = self.selection.name
        return frozenset(o.name for o in self.scene.objects if name is not None and name in (o.name, o.part_of))

    @property
    def divider(self) -> Divider | None:
        """The divider, if two pictures are shown."""
        if self.states.split:
            return self.states.divider
        return self.comparison.divider if self.comparison.mode == "side by side" else None

    @property
    def unsaved_materials(self) -> tuple[str, ...]:
        """Materials that are kept neither in the session nor as a document."""
        return tuple(name for name in self.session.unsaved if name in self.scene.materials)

    @classmethod
    def of(
        cls, scene: SceneRecord, movement: Movement, screen: Screen, store: Path | None = None, session: bool = True
    ) -> WalkState:
        """State at the scene's first camera and exposure, with the views saved in the folder of the `store`.

        Without a `session`, edits are not kept.
        """
        look, meter = Look(scene.exposure_ev or 0.0), Meter(expose_wanted=scene.exposure_ev is None)
        navigation, views = Navigation.of(scene, movement), SavedViews(scene, store, screen.say)
        fault, edits = views.load(), MaterialEdits(scene.materials)
        lights = Lights(edits=edits)
        return cls(
            scene, screen, look, navigation, Selection(whole_objects(scene.objects)),
            Materials(edits, screen), Recordings(views, navigation, screen, lights),
            Marks({}, scene.reflectors), SessionKeeper(edits, store if session else None, screen), States(edits, scene),
            Texturing(edits, screen, store),
            meter=meter, lights=lights, lamps=Lamps(edits, say=screen.say),
            store=store, store_name="STORE" if store is None else store.name,
            missing=() if fault is None else (fault,),  # a message would vanish before the window is open
        )  # fmt: skip
