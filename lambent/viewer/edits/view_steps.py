"""The steps of a view that is edited in place: those of the room, whose materials it has."""

from __future__ import annotations

from lambent.editing.session.document import SessionDocument
from lambent.viewer.edits.edits import MaterialEdits


class ViewSteps:
    """`Steps` of a `Session` in the history of `edits`; `begun` is the view until it is changed.

    Where that differs from the present state, in its materials or as a view, it becomes that as the first step.
    """

    def __init__(self, edits: MaterialEdits, begun: SessionDocument) -> None:
        self._edits, self._begun = edits, begun
        self._of: tuple[object, object] | None = None
        self._now = begun
        there = edits.views.get(begun.camera.name, begun)
        same = _shape(there) == _shape(begun)
        if not same or any(one.now != edits.current(name) for name, one in begun.materials.items()):
            edits.change_view(begun)
            edits.end_stroke()

    @property
    def now(self) -> SessionDocument:
        edits = self._edits
        of = edits.views.get(self._begun.camera.name, self._begun), edits.edited
        if self._of is None or any(a is not b for a, b in zip(of, self._of, strict=True)):
            self._of = of
            # A store's session names its scene ".".
            self._now = edits.in_room(of[0]).model_copy(update={"scene": self._begun.scene})
        return self._now

    def change(self, state: SessionDocument) -> None:
        in_stroke = self._edits.in_stroke
        self._edits.change_view(state)
        if not in_stroke:
            self._edits.end_stroke()

    def begin_stroke(self) -> None:
        self._edits.history.begin_stroke()

    def restart_stroke(self) -> None:
        self._edits.history.restart_stroke()

    def end_stroke(self) -> None:
        self._edits.end_stroke()

    @property
    def can_undo(self) -> bool:
        return self._edits.can_undo

    @property
    def can_redo(self) -> bool:
        return self._edits.can_redo

    def undo(self) -> None:
        self._edits.undo()

    def redo(self) -> None:
        self._edits.redo()


def _shape(view: SessionDocument) -> tuple[object, ...]:
    """What a view is of, apart from what its materials are now."""
    return view.camera, view.size, view.environment, view.merged, view.materials.keys()
