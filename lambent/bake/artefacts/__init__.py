"""Kinds of artefacts, one file each; `lambent.bake.context` says what belongs into one."""
