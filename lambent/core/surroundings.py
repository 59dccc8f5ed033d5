"""How a picture of everything around is laid out, and along which axis of the world its up points."""

from typing import Literal

Layout = Literal["lat-long", "angular", "cross", "strip"]  # see core.environment_layouts
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
