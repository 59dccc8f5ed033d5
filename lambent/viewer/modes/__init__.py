"""The modes of the window. A folder or file here is a mode; no list is edited.

Its module defines

- `STARTS`: the names that it is opened by, as `app.run` takes them;
- `NO_DISPLAY`: what to do where there is no display, for the error message;
- `start(path, name, screen, **options)`: the `Mode` (see `lambent.viewer.mode`) that shows `path`, opened by `name`;
- `edits(path)`, optional: whether `lambent edit` opens `path` in this mode.

The module itself is light: `start` imports what the mode draws with. Panels, drawing and input stand beside it.
"""
