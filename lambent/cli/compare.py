"""`lambent compare`: the difference of two images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Force, Json, show, table


def command(
    reference: Annotated[Path, typer.Argument(help="Reference image: EXR, HDR, PNG or JPEG.")],
    test: Annotated[Path, typer.Argument(help="Image to compare with it, of the same size.")],
    output: Annotated[Path | None, typer.Option("-o", help="Write the FLIP difference as an image (.png).")] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Compare two images: PSNR, RMSE in RGB and L*a*b*, FLIP with its worst 16x16 tile.

    Where both are EXR or HDR, PSNR and FLIP compare clip(e L)^(1/2.2), with e such that the reference has a mean of .3,
    and RMSE compares radiance. Otherwise all compare the pictures as a display shows them.

    Example: lambent compare reference.exr frame.exr -o difference.png
    """
    from lambent.api.pictures import compare
    from lambent.core.light.colour import srgb_decode
    from lambent.core.outputs import check_output
    from lambent.core.pictures.images import write_image

    if output is not None:
        check_output(output, (".png",), force=force, inputs=[reference, test])
    compared = compare(reference, test)
    result = compared.figures
    if output is not None:
        write_image(output, srgb_decode(compared.difference))
        result["difference"] = output
    row, column = result["flip_worst_tile_at"]
    rows = [
        ("PSNR", f"{result['psnr_db']:.2f} dB"),
        ("RMSE RGB", "  ".join(f"{value:.5f}" for value in result["rmse_rgb"])),
        ("RMSE L*a*b*", "  ".join(f"{value:.3f}" for value in result["rmse_lab"])),
        ("FLIP mean", f"{result['flip_mean']:.4f}"),
        ("FLIP worst tile", f"{result['flip_worst_tile']:.4f} at row {row}, column {column}"),
    ]
    show(result, table(rows), json)
