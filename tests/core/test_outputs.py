"""What is written, and onto what: regular files alone, whole or not at all, with the mode that is due."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from lambent.core import files
from lambent.core.errors import UserError
from lambent.core.files import atomic_path, check_place, remove_left_over, write_text
from lambent.core.outputs import OF_FILES, check_new_folder, check_output, is_marked
from lambent.core.pictures.film import film_writer
from lambent.core.pictures.images import read_image, write_image, write_shown
from lambent.materials.plots import new_figure, save_figure
from lambent.report.page import page

posix = pytest.mark.skipif(sys.platform == "win32", reason="devices, pipes and modes are of POSIX")
PICTURE = np.full((8, 8, 3), 0.25, np.float32)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@posix
def test_a_device_or_a_pipe_is_no_place_for_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/full")
    for place in (Path("/dev/full"), tmp_path / "pipe", tmp_path / "link"):
        before = place.stat().st_mode
        for attempt in (check_place, lambda path: write_text(path, "x")):
            with pytest.raises(UserError, match="is a device or a pipe") as caught:
                attempt(place)
            assert str(caught.value).startswith(str(place))
        assert place.stat().st_mode == before
    assert (tmp_path / "link").is_symlink()


@posix
def test_a_link_stays_and_its_target_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there/file")
    for text in ("new", "newer"):  # the target is not there at first
        write_text(tmp_path / "link", text)
        assert (tmp_path / "link").is_symlink() and (tmp_path / "there/file").read_text() == text
    (tmp_path / "circle").symlink_to("circle")
    with pytest.raises(UserError, match="circle: cannot be written"):
        write_text(tmp_path / "circle", "x")


def test_an_error_leaves_the_former_file_and_nothing_else(tmp_path: Path) -> None:
    write_text(tmp_path / "a", "former")
    with (
        pytest.raises(UserError, match=r"a: cannot be written \(No space left on device\)"),
        atomic_path(tmp_path / "a") as beside,
    ):
        beside.write_text("part")
        raise OSError(28, "No space left on device")
    with pytest.raises(FileNotFoundError, match="another"), atomic_path(tmp_path / "a"):
        (tmp_path / "another").read_text()
    assert [path.name for path in tmp_path.iterdir()] == ["a"] and (tmp_path / "a").read_text() == "former"
    with pytest.raises(UserError, match="is a folder"):
        write_text(tmp_path, "x")
    with pytest.raises(UserError, match=r"a/b/c: cannot be written"):
        write_text(tmp_path / "a/b/c", "x")


WRITERS: dict[str, str] = {
    "a.exr": "from lambent.core.pictures.images import write_image; write_image(path, np.random.rand(64, 64, 3))",
    "a.mp4": "from lambent.core.pictures.film import film_writer\n"
    "with film_writer(path, 64, 64) as write: [write(np.random.randint(0, 255, (64, 64, 3), np.uint8)) for _ in '12']",
}


@posix
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_former_file(tmp_path: Path, name: str) -> None:
    """Files of at most 512 bytes are as a disk that is full."""
    program = (
        "import resource, sys; from pathlib import Path; import numpy as np; path = Path(sys.argv[1])\n"
        "from lambent.core.errors import UserError\n"
        f"def write():\n    {WRITERS[name].replace(chr(10), chr(10) + '    ')}\n"
        "import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512))\n"
        "try:\n    write()\nexcept UserError as error:\n    sys.stdout.write(str(error))\n"
    )
    (tmp_path / name).write_text("former")
    command = [sys.executable, "-c", program, str(tmp_path / name)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith(f"{tmp_path / name}: ") and ".lambent-" not in done.stdout, done
    assert (tmp_path / name).read_text() == "former"
    assert [path.name for path in tmp_path.iterdir()] == [name]


@posix
def test_what_a_killed_process_left_goes_and_nothing_else(tmp_path: Path) -> None:
    program = (
        "import os, signal, sys; from pathlib import Path; from lambent.core.files import atomic_path\n"
        "with atomic_path(Path(sys.argv[1])): os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "a.png")], check=False)
    (left,) = tmp_path.iterdir()
    of = files._BESIDE.match(left.name)[1]  # type: ignore[index]
    living, namesake = (tmp_path / left.name.replace(of, str(number)) for number in (os.getppid(), os.getpid()))
    namesake.write_text("")  # of a dead process whose number is ours now
    elsewhere = tmp_path / left.name.replace(files._MACHINE, ".lambent-00000000-")
    kept = {living, elsewhere, tmp_path / ".a.1234.png", tmp_path / f"{left.name[1:]}"}
    for path in kept:
        path.write_text("")
    with atomic_path(tmp_path / "b.png") as mine:
        remove_left_over(tmp_path)
        assert mine.exists() and not left.exists() and not namesake.exists()
    assert set(tmp_path.iterdir()) == kept | {tmp_path / "b.png"}


def drawn(folder: Path) -> dict[str, Callable[[Path], object]]:
    """By ending, what writes a picture, a film or a page."""
    shown = np.zeros((8, 8, 3), np.uint8)

    def film(path: Path) -> None:
        with film_writer(path, 8, 8) as write:
            for _ in range(3):
                write(shown)

    return {
        ".png": lambda path: write_shown(path, shown),
        ".exr": lambda path: write_image(path, PICTURE),
        ".hdr": lambda path: write_image(path, PICTURE),
        ".mp4": film,
        ".pdf": lambda path: save_figure(new_figure(1, 1), path),
        ".html": lambda path: write_text(path, page("<script>", [])),
    }


@pytest.mark.parametrize("ending", drawn(Path()))
def test_what_lambent_draws_is_known_by_its_mark(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    drawn(tmp_path)[ending](path)
    assert is_marked(path)
    check_output(path, (ending,), force=False)
    with pytest.raises(UserError, match=r"output is the input.*--force"):
        check_output(path, (ending,), force=False, inputs=[path])
    check_output(path, (ending,), force=True, inputs=[path])
    if ending in (".exr", ".hdr"):
        np.testing.assert_array_equal(read_image(path), PICTURE)
    if ending == ".mp4":
        assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 3


def test_other_files_are_replaced_by_force_alone(tmp_path: Path) -> None:
    path, twin = tmp_path / "a.png", tmp_path / "twin.png"
    check_output(path, (".png",), force=False)
    path.write_bytes(b"\x89PNG of another program")
    with pytest.raises(UserError, match=r"a\.png: exists already; .*--force"):
        check_output(path, (".png",), force=False)
    os.link(path, twin)
    with pytest.raises(UserError, match="output is the input"):
        check_output(path, force=False, inputs=["builtin:room", twin])
    check_output(path, (".png",), force=True)
    assert not is_marked(tmp_path / "absent.png") and not is_marked(tmp_path)
    with pytest.raises(UserError, match=r"found \.txt; expected \.png"):
        check_output(tmp_path / "a.txt", (".png",), force=True)


def test_folders_are_not_named_like_files(tmp_path):
    from lambent.core.discovery import modules_in
    from lambent.core.pictures.film import FILM
    from lambent.core.pictures.images import WRITABLE
    from lambent.materials import export
    from lambent.scenes import loaders
    from lambent.scenes.photometry.files import ENDINGS

    modules = [*modules_in(loaders, having="ENDINGS").values(), *modules_in(export, having="ENDINGS").values()]
    endings = {ending for module in modules for ending in module.ENDINGS} | {*WRITABLE, FILM, *ENDINGS}
    assert endings <= set(OF_FILES)
    for ending in ("", ".store", ".example.org", "-1.2", ".v2"):
        check_new_folder(tmp_path / f"room{ending}", "a site")
    (tmp_path / "old.json").mkdir()
    check_new_folder(tmp_path / "old.json", "a site")
    with pytest.raises(UserError, match=r"room\.GLB: names a file, and a site is a folder; .* such as room$"):
        check_new_folder(tmp_path / "room.GLB", "a site")
