"""The curves of a material, to be pulled: `CurveEditor` draws them and edits a session.

`axes`, `regions`, `drags`, `lines`, `strokes` and `state` hold the logic, without Dear ImGui. `editor`, `plot`,
`toolbar`, `layers` and `quantities` draw.
"""

from lambent.viewer.modes.edit.curves.editor import CurveEditor as CurveEditor
