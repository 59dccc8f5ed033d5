"""Kinds of artefacts, one file each; `lambent.baking.context` describes what a file must contain."""
