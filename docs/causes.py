"""Makes the figure of the largest causes of error: crops of ours, path traced, and FLIP.

lambent render STORE --size 960x540 -o ours.exr
lambent render STORE --size 960x540 --integrator path --samples 1024 -o path.exr
.venv/bin/python docs/causes.py ours.exr path.exr causes.jpg [--exposure EV] [NAME NAME NAME]

The crops are the places, apart from each other, that hold the most of the error; NAMEs are written beside their shares.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from lambent.core.colour import filmic, srgb_encode
from lambent.core.images import read_image, to_bytes
from lambent.core.metrics import display_pair, flip, psnr

LIMIT_BYTES = 300_000
COUNT = 3
SHARE = 0.25  # of the picture's sides that a crop has
WIDTH = 360  # pixels of a crop in the figure
GAP = 6


def main(ours: Path, path: Path, output: Path, exposure_ev: float, names: list[str]) -> None:
    test, reference = read_image(ours), read_image(path)
    shown = display_pair(reference, test)
    seen = flip(*shown)
    print(f"PSNR {psnr(*shown):.2f} dB, FLIP {seen.mean:.4f}, worst tile {seen.worst_tile:.3f}")
    pictures = [to_bytes(srgb_encode(filmic(picture, exposure_ev))) for picture in (test, reference)]
    pictures.append(to_bytes(seen.picture))
    rows = []
    for number, (rows_of, columns) in enumerate(places(seen.error)):
        part = seen.error[rows_of, columns]
        share = part.sum() / seen.error.sum()
        name = names[number] if number < len(names) else f"cause {number + 1}"
        text = (
            f"{name}: FLIP {part.mean():.3f}, {100 * share:.0f} % of the error on {100 * SHARE**2:.0f} % of the picture"
        )
        print(f"{text}; rows {rows_of.start}-{rows_of.stop}, columns {columns.start}-{columns.stop}")
        rows.append(labelled([crop[rows_of, columns] for crop in pictures], text))
    save(np.concatenate(rows), output)


def places(error: np.ndarray) -> list[tuple[slice, slice]]:
    """The COUNT rectangles, apart from each other, of the largest sums of error, one after another."""
    height, width = (round(SHARE * side) for side in error.shape)
    left, found = error.astype(float), []
    for _ in range(COUNT):
        total = np.pad(left.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        sums = total[height:, width:] - total[:-height, width:] - total[height:, :-width] + total[:-height, :-width]
        row, column = np.unravel_index(int(sums.argmax()), sums.shape)
        place = slice(int(row), int(row) + height), slice(int(column), int(column) + width)
        found.append(place)
        left[place] = -error.sum()  # so that no other touches it
    return found


def labelled(crops: list[np.ndarray], text: str) -> np.ndarray:
    height = round(WIDTH * crops[0].shape[0] / crops[0].shape[1])
    line = Image.new("RGB", (len(crops) * WIDTH + (len(crops) - 1) * GAP, height + 22), "white")
    for number, crop in enumerate(crops):
        scaled = Image.fromarray(crop).resize((WIDTH, height), Image.Resampling.LANCZOS)
        line.paste(scaled, (number * (WIDTH + GAP), 18))
    ImageDraw.Draw(line).text((2, 2), text, fill="black")
    return np.asarray(line)


def save(picture: np.ndarray, path: Path) -> None:
    Image.fromarray(picture).save(path, quality=86, optimize=True)
    assert path.stat().st_size < LIMIT_BYTES, f"{path}: {path.stat().st_size} bytes"
    print(path, path.stat().st_size)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ours", type=Path)
    parser.add_argument("path", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--exposure", type=float, default=0.0)
    given = parser.parse_args()
    main(given.ours, given.path, given.output, given.exposure, given.names)
