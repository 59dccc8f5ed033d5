"""Blender's space and units in Lambent's: y up, metres, watts."""

from __future__ import annotations


class Frame:
    """The space of a scene.

    `metres` is the length of one unit. Without a unit system Blender ignores its scale, and so does this. Blender's
    watts scale with the square of it, like the areas that they light: so pictures stay as bright.
    """

    def __init__(self, scene):
        units = scene.unit_settings
        self.metres = 1.0 if units.system == "NONE" else float(f"{units.scale_length:.6g}")

    def place(self, point):
        """[x, y, z] in metres, y up, of a point in units, z up."""
        return [self.metres * x for x in upright(point)]

    def watts(self, power):
        """Watts, or units of power on a square metre, of Blender's number."""
        return power * self.metres**2


def upright(vector):
    """[x, y, z] with y up of a vector with z up."""
    x, y, z = vector
    return [x, z, -y]


def behind(matrix):
    """Unit vector, y up, along which a lamp or a camera with this world matrix looks: its -z."""
    return upright((-matrix.col[2].xyz).normalized())
