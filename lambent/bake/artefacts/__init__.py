"""Kinds of artefacts, one file each; `lambent.bake.context` describes its contents."""
