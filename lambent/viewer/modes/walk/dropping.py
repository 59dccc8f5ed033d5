"""What a file does that is dropped onto the picture: it goes to the lamp, the object or the sky under the mouse."""

from __future__ import annotations

from pathlib import Path

from lambent.core.errors import UserError
from lambent.scenes.photometry.files import ENDINGS as LUMINAIRES
from lambent.viewer.editor.files import ENVIRONMENTS, kind_of
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.session.finishes import Finish, Finishes
from lambent.viewer.modes.walk.session.leaving import can_leave, relight_view
from lambent.viewer.modes.walk.session.texturing import ENDINGS as IMAGES
from lambent.viewer.modes.walk.state import WalkState

NO_LAMPS = "this room has no lamps to exchange: `lambent bake` finds those of IES and EULUMDAT files"
SKY = "the sky is baked: name it as the scene's environment and bake again"
NOTHING = "drop it onto an object, or select one first"


def drop(path: str, state: WalkState, input: WalkInput, finishes: Finishes) -> None:
    """Exchange a lamp's luminaire, show an image, take a material, or compare with a measurement; else say why not."""
    file, say, editor = Path(path), state.screen.say, state.materials.editor
    if path.lower().endswith(LUMINAIRES):
        _onto_lamp(path, state, input)
        return
    if input.is_over_sky and file.suffix.lower() in ENVIRONMENTS:
        if can_leave(state):
            relight_view(state, file)
        else:
            say(f"{file.name} is not shown: {SKY}")
        return
    input.select_under_cursor()
    name = state.selection.material
    if name is None:
        say(f"{file.name}: {NOTHING}")
    elif path.lower().endswith(IMAGES):
        state.texturing.open(name, path)
    elif editor is not None:
        editor.files.open(path)
    else:
        _onto_material(file, name, state, finishes)


def _onto_lamp(path: str, state: WalkState, input: WalkInput) -> None:
    if not state.lamps.records:
        state.screen.say(f"{Path(path).name} is not shown: {NO_LAMPS}")
        return
    input.choose_lamp_under_cursor()
    state.lamps.exchange(path)


def _onto_material(file: Path, name: str, state: WalkState, finishes: Finishes) -> None:
    try:
        kind = kind_of(file)
    except UserError as error:
        state.screen.say(f"not opened: {error}")
        return
    if kind == "material":
        finishes.choose(name, Finish(file.stem, file))
        return
    state.materials.open_editor(name, str(file))
    state.screen.size = "measure"  # where the plots are
