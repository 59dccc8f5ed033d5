"""Films, H.264 in MP4, and sequences of pictures. A film appears whole or not at all; so does each picture."""

from __future__ import annotations

import errno
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.files import atomic_path
from lambent.core.outputs import MARK, check_output

Frame = NDArray[np.uint8]
FILM = ".mp4"
SEQUENCES = (".png", ".exr")
# Convert and tag the matrix explicitly: untagged, players assume BT.601 for small films and BT.709 for large ones.
_BT709 = ["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709", "-color_primaries", "bt709",
          "-color_trc", "bt709", "-color_range", "tv"]  # fmt: skip
_MARKED = ["-metadata", f"comment={MARK}"]
_CONSTANT_QUALITY = ["-crf", "18", "-preset", "medium", "-movflags", "+faststart"]


@contextmanager
def film_writer(path: Path, width: int, height: int, fps: float = 30) -> Iterator[Callable[[Frame], None]]:
    """Yield a function that takes the next frame, (height, width, 3) uint8 encoded; the film is complete on leaving.

    An error or an interruption within the block leaves no file. No frame is kept in memory.

    Parameters
    ----------
    path : Path
        Ends in .mp4.
    width, height : int
        Even, as 4:2:0 chroma needs; see `even_size`.

    Raises
    ------
    UserError
        If ffmpeg is missing or fails.
    """
    import imageio_ffmpeg

    assert width % 2 == 0 and height % 2 == 0, f"odd size {width}x{height}"
    with atomic_path(path) as temporary:
        try:
            writer = imageio_ffmpeg.write_frames(
                str(temporary),
                (width, height),
                fps=fps,
                codec="libx264",
                pix_fmt_out="yuv420p",
                quality=None,
                macro_block_size=2,
                output_params=[*_BT709, *_CONSTANT_QUALITY, *_MARKED],
            )
            writer.send(None)

            def write(frame: Frame) -> None:
                assert frame.shape == (height, width, 3) and frame.dtype == np.uint8, (frame.shape, frame.dtype)
                writer.send(np.ascontiguousarray(frame))

            try:
                yield write
            finally:
                writer.close()
            if not _is_whole(temporary):  # ffmpeg does not report late errors such as a full disk
                raise OSError(errno.ENOSPC, "the end of the film could not be written: is the disk full?")
        except (OSError, RuntimeError) as error:
            said = str(error).replace(str(temporary), str(path))
            raise UserError(f"film could not be written ({said})", file=path) from error


def _is_whole(path: Path) -> bool:
    """Whether the boxes of an MP4 file (ISO 14496-12) end exactly at its end and include an index."""
    kinds, at, end = set(), 0, path.stat().st_size
    with path.open("rb") as file:
        while at + 8 <= end:
            file.seek(at)
            size, kind = struct.unpack(">I4s", file.read(8))
            if size == 1:
                size = struct.unpack(">Q", file.read(8).ljust(8, b"\0"))[0]
            if size < 8:
                return False
            kinds.add(kind)
            at += size
    return at == end and b"moov" in kinds


def even_size(width: int, height: int) -> tuple[int, int]:
    """The size rounded down to even numbers, at least 2 x 2."""
    return max(2, width - width % 2), max(2, height - height % 2)


def sequence_file(path: Path, number: int) -> Path:
    """Path of picture `number` of a sequence: it replaces the # signs of `path`, or is appended with four digits.

    Raises
    ------
    UserError
        If the name has # signs in several places.
    """
    stem, signs, rest = re.fullmatch(r"([^#]*)(#*)(.*)", path.stem, re.DOTALL).groups()  # type: ignore[union-attr]
    if "#" in rest:
        raise UserError(
            "is not a name for an image sequence", file=path, expected="one run of # signs, as in tour-####.png"
        )
    return path.with_name(f"{stem}{number:0{len(signs)}}{rest}{path.suffix}" if signs else
                          f"{path.stem}-{number:04}{path.suffix}")  # fmt: skip


def pictures_there(path: Path) -> list[Path]:
    """The existing film, or the existing pictures of the sequence."""
    if path.suffix.lower() == FILM or not path.parent.is_dir():
        return [path] if path.exists() else []
    numbered = ((file, map(int, re.findall(r"[0-9]+", file.stem))) for file in path.parent.iterdir())
    return [file for file, numbers in numbered if any(sequence_file(path, n).name == file.name for n in numbers)]


def check_pictures(path: Path, *, force: bool) -> None:
    """`check_output` for a film, or for every picture of a sequence."""
    check_output(path if path.suffix.lower() == FILM else sequence_file(path, 1), (FILM, *SEQUENCES), force=force)
    for file in pictures_there(path):
        check_output(file, force=force)


@contextmanager
def sequence_writer(path: Path) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Yield a function that writes the next picture of a sequence, named by `sequence_file` from number 1.

    PNG takes (height, width, 3) uint8 encoded, EXR linear radiance. An interruption leaves the earlier pictures.

    Raises
    ------
    UserError
        If a picture cannot be written.
    """
    from lambent.core.pictures.images import check_writable, write_image, write_shown

    check_writable(path, SEQUENCES)
    sequence_file(path, 1)
    numbers = count(1)

    def write(picture: NDArray[Any]) -> None:
        file = sequence_file(path, next(numbers))
        try:
            (write_image if radiance_wanted(path) else write_shown)(file, picture)
        except OSError as error:
            raise UserError(f"could not be written ({error})", file=file) from error

    yield write


def pictures_writer(
    path: Path, width: int, height: int, fps: float
) -> AbstractContextManager[Callable[[NDArray[Any]], None]]:
    """`film_writer` or `sequence_writer`, by the suffix."""
    return film_writer(path, width, height, fps) if path.suffix.lower() == FILM else sequence_writer(path)


def radiance_wanted(path: Path) -> bool:
    """Whether a picture sequence of this suffix takes radiance instead of display values."""
    return path.suffix.lower() == ".exr"
