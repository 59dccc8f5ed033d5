"""`lambent compare`: how far two pictures are apart."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Json, show, table
from lambent.core.errors import UserError


def command(
    reference: Annotated[Path, typer.Argument(help="Picture taken as the truth: EXR, HDR, PNG or JPEG.")],
    test: Annotated[Path, typer.Argument(help="Picture to judge, of the same size.")],
    output: Annotated[Path | None, typer.Option("-o", help="Write the FLIP difference as a picture (.png).")] = None,
    json: Json = False,
) -> None:
    """Compare two pictures: PSNR, RMSE in RGB and L*a*b*, FLIP with its worst 16x16 tile.

    Where both are EXR or HDR, PSNR and FLIP are taken of clip(e L)^(1/2.2), with e such that the reference has a mean
    of .3, and RMSE of the radiance itself. Otherwise both are taken as a display shows them.

    Example: lambent compare reference.exr frame.exr -o difference.png
    """
    from lambent.core.images import check_writable, read_image, write_image
    from lambent.core.metrics import compare

    if output is not None:
        check_writable(output, (".png",))
    pictures = read_image(reference), read_image(test)
    if pictures[0].shape != pictures[1].shape:
        sizes = ["{1}x{0}".format(*picture.shape) for picture in pictures]
        raise UserError("pictures differ in size", file=test, got=sizes[1], expected=f"{sizes[0]} as {reference}")
    result, difference = compare(*pictures, radiance=_is_radiance(reference) and _is_radiance(test))
    if output is not None:
        from lambent.core.colour import srgb_decode

        write_image(output, srgb_decode(difference))
        result["difference"] = output
    rows = [
        ("PSNR", f"{result['psnr_db']:.2f} dB"),
        ("RMSE RGB", "  ".join(f"{value:.5f}" for value in result["rmse_rgb"])),
        ("RMSE L*a*b*", "  ".join(f"{value:.3f}" for value in result["rmse_lab"])),
        ("FLIP mean", f"{result['flip_mean']:.4f}"),
        ("FLIP worst tile", "{flip_worst_tile:.4f} at row {0}, column {1}".format(
            *result["flip_worst_tile_at"], **result)),
    ]  # fmt: skip
    show(result, table(rows), json)


def _is_radiance(path: Path) -> bool:
    from lambent.core.images import HDR_SUFFIXES

    return path.suffix.lower() in HDR_SUFFIXES
