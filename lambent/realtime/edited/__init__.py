"""Edited pictures on a GPU: sums of transport rows, folding of curves, and the picture in a texture.

All functions take plain arrays, as defined in `lambent.editing`; the window connects both packages.
"""
