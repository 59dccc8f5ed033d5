"""Bakes of the built-in box in other materials, recorded to be replayed as often as tests want them."""

import io
import json

from lambent.baking.running.again import bake_again
from lambent.store.kept.session import RoomState
from lambent.viewer.modes.walk.rebake.rebaking_worker import StreamWatch
from tests.baking.small_scenes import TINY

TILES = TINY.changed("tiles", light_map={"tile_texels": 16})
REPLAYS = """
import shutil
(recording,) = (one for one in Path({recordings!r}).iterdir()
                if json.loads((one / "asked.json").read_text()) == asked["materials"])
pieces = [(recording / name).read_bytes() for name in ("first", "rest")]
shutil.copytree(recording / "copy", sys.argv[2], dirs_exist_ok=True)
for number, piece in enumerate(pieces):
    while number == {waits_at} and not Path({flag!r}).exists():
        time.sleep(0.01)
    sys.stdout.buffer.write(piece)
    sys.stdout.buffer.flush()
say(baked=True)
"""


class Recording(StreamWatch):
    """Keeps what a bake reports; `half`: its length when more than half of the texels had arrived."""

    region_pause, half = 0.0, 0

    def __init__(self):
        self.stream = io.BytesIO()
        super().__init__(self.stream)

    def region(self, light, finished):
        super().region(light, finished)
        if not self.half and finished.mean() > 0.5:
            self.half = self.stream.tell()


def record(store, folder, materials):
    """Bake a store again for materials, and write the copy and the reports for `REPLAYS`."""
    watch = Recording()
    bake_again(store, folder / "copy", materials, quality=TILES, watch=watch).close()
    asked = RoomState(materials=materials).model_dump(mode="json")["materials"]
    (folder / "asked.json").write_text(json.dumps(asked))
    said = watch.stream.getvalue()
    (folder / "first").write_bytes(said[: watch.half])
    (folder / "rest").write_bytes(said[watch.half :])


class Box:
    """The built-in box, and recorded bakes of it in other materials."""

    def __init__(self, store, recordings):
        self.store, self.recordings = store, recordings

    def record(self, name, materials):
        (self.recordings / name).mkdir(parents=True)
        record(self.store, self.recordings / name, materials)

    def replays(self, flag=__file__, waits_at=0):
        """A worker that replays the bake it is asked for; it waits for a file before a piece of it."""
        return REPLAYS.format(recordings=str(self.recordings), flag=str(flag), waits_at=waits_at)


def painted(scene):
    """The walls' material dark, another one red."""
    first, second = sorted(scene.materials)[:2]
    dark = scene.materials[first].model_copy(update={"kd": (0.1, 0.1, 0.1)})
    return {first: dark, second: scene.materials[second].model_copy(update={"kd": (0.6, 0.1, 0.05)})}
