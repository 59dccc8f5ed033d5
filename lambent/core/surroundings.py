"""Layouts of pictures of the surroundings, and the world axis of their up."""

from typing import Literal

Layout = Literal["lat-long", "angular", "cross", "strip"]  # see core.environment_layouts
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
