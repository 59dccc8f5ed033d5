"""The panels: one file each, with a TITLE and `draw(state)`. They read and write only the state."""
