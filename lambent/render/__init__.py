"""Stills, films and image sequences of a baked store, without a window.

from lambent.render import Settings, film, images, sheet, still

still("room.store", "entrance.png", "entrance")
film("room.store", "tour.mp4", settings=Settings(1920, 1080), fps=25)
edited_still("room.store", Path("tray.edits.json"), "tray.png")
sheet("room.store", "variants.png")
radiance = images(Store.open("room.store"), Settings(integrator="path")).radiance(camera)
"""

from lambent.render.as_left import as_left
from lambent.render.edited import edited_still
from lambent.render.images import Images, Settings
from lambent.render.output import Rendered, film, images, still, write_frames
from lambent.render.sheet import sheet

__all__ = [
    "Images",
    "Rendered",
    "Settings",
    "as_left",
    "edited_still",
    "film",
    "images",
    "sheet",
    "still",
    "write_frames",
]
