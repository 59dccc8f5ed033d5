"""The modes of the window. A folder or file here is a mode; no list is edited.

Its module defines

- `STARTS`: the names that open it, for `app.run`;
- `NO_DISPLAY`: an alternative without a display, for the error message;
- `start(path, name, screen, **options)`: the `Mode` (see `lambent.viewer.mode`) that shows `path`, opened by `name`;
- `edits(path)`, optional: whether `lambent edit` opens `path` in this mode.

The module itself loads quickly: `start` imports the mode's other modules, such as panels, drawing and input.
"""
