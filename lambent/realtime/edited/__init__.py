"""Edited pictures on a GPU: sums of transport rows, folding of curves, and the picture in a texture.

Everything here takes plain arrays, with the meaning that `lambent.editing` gives them; the window joins both.
"""
