"""`lambent lightmap`: the baked light map as an image, with the meshes that it belongs to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Force, Json, show


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    output: Annotated[Path, typer.Option("-o", help="Image to write (.exr); the meshes go beside it (.glb).")],
    force: Force = False,
    json: Json = False,
) -> None:
    """Write the light map for other programs: irradiance, W/m², and meshes with its coordinates as second uv set.

    The direct light of the sun is not in it: renderers add that by shadow maps.

    Example: lambent lightmap room.store -o light.exr
    """
    import lambent
    from lambent.core.outputs import check_output
    from lambent.store.light_map_file import meshes_beside

    for path, ending in ((output, ".exr"), (meshes_beside(output), ".glb")):
        check_output(path, (ending,), force=force)
    lambent.open(store).light_map(output)
    show({"written": [output, meshes_beside(output)]}, f"{output}\n{meshes_beside(output)}", json)
