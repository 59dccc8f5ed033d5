"""Kinds of artefacts, one file each; `lambent.bake.context` describes what a file must contain."""
