"""The curve editor: `editor.CurveEditor` draws the curves of a material and edits a session.

`axes`, `regions`, `drags`, `lines`, `strokes` and `state` have the logic, without Dear ImGui. `editor`, `plot`,
`toolbar`, `layers` and `quantities` draw.
"""
