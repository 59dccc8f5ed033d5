"""Stills, films and image sequences of a baked store, without a window.

from lambent.render import Settings, film, images, still

still("room.store", "entrance.png", "entrance")
film("room.store", "tour.mp4", settings=Settings(1920, 1080), fps=25)
radiance = images(Store.open("room.store"), Settings(integrator="path")).radiance(camera)
"""

from lambent.render.images import Images, Settings
from lambent.render.output import Rendered, film, images, still, write_frames

__all__ = ["Images", "Rendered", "Settings", "film", "images", "still", "write_frames"]
