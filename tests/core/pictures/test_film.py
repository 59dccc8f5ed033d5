"""A film plays what was written; an interrupted one leaves nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.pictures.film import even_size, film_writer


def test_colours_and_length_survive(tmp_path: Path) -> None:
    import imageio_ffmpeg

    colours = np.array([[200, 40, 40], [40, 200, 40], [40, 40, 200], [128, 128, 128]], np.uint8)
    with film_writer(tmp_path / "a.mp4", 64, 48, fps=10) as write:
        for colour in colours:
            write(np.broadcast_to(colour, (48, 64, 3)).copy())
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    meta = next(reader)
    frames = [np.frombuffer(data, np.uint8).reshape(48, 64, 3) for data in reader]
    assert meta["size"] == (64, 48) and meta["fps"] == 10 and "h264" in meta["codec"]
    assert len(frames) == 4
    for frame, colour in zip(frames, colours, strict=True):
        np.testing.assert_allclose(frame.mean(axis=(0, 1)), colour, atol=6)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_interruption_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), film_writer(tmp_path / "a.mp4", 64, 48) as write:
        write(np.zeros((48, 64, 3), np.uint8))
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


def test_even_size() -> None:
    assert even_size(641, 480) == (640, 480)
    assert even_size(1, 1) == (2, 2)


def test_a_film_without_its_end_is_none(tmp_path):
    """ffmpeg says nothing where the disk fills up at the end."""
    from lambent.core.pictures.film import _is_whole

    with film_writer(tmp_path / "a.mp4", 32, 32) as write:
        for value in range(4):
            write(np.full((32, 32, 3), 60 * value, np.uint8))
    data = (tmp_path / "a.mp4").read_bytes()
    assert _is_whole(tmp_path / "a.mp4")
    for cut in (0, 7, 40, len(data) // 2, len(data) - 1):
        (tmp_path / "cut.mp4").write_bytes(data[:cut])
        assert not _is_whole(tmp_path / "cut.mp4"), cut
    (tmp_path / "cut.mp4").write_bytes(data.replace(b"moov", b"free"))
    assert not _is_whole(tmp_path / "cut.mp4")
