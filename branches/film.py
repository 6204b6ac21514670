"""A branch as a film: the strip as it folds, above the curve on which a dot moves."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator

import numpy as np

from branches.draw_branch import choose, curve, draw_strip
from branches.files import StoreError

#: Frames a second. Ten times more is faster than a person sees, and GIF has no more than 50.
RATE = 12
#: Size of a frame in inches at _DPI dots per inch: 640 x 640 dots. MP4 wants even numbers, and ten times more dots would make
#: files of hundreds of megabytes.
_SIZE, _DPI = 6.4, 100
#: Width of the strip where none is given, in units of L/2 pi: that of the pictures.
_WIDTH = 0.3


def film(branch, ending: str, frames: int, width: float | None = None) -> bytes:
    """The film of a branch, as the content of a file.

    Parameters
    ----------
    branch : branches.read.StoredBranch
    ending : str
        ".gif" or ".mp4".
    frames : int
        At most so many, at equal distances along the branch; each shows a point whose solution is kept.
    width : float, optional
        Width of the drawn strip, in units of L/2 pi.

    Raises
    ------
    StoreError
        The branch keeps fewer than two solutions; or what writes this format is not installed.
    """
    chosen = choose(branch, frames)
    if len(chosen) < 2:
        raise StoreError(f"a film needs 2 points whose solutions are kept, and there are {len(chosen)}")
    write = {".gif": _gif, ".mp4": _mp4}[ending]
    return write(drawn(branch, chosen, width or _WIDTH))


def drawn(branch, chosen: list[int], width: float) -> Iterator[np.ndarray]:
    """Pictures of points of a branch, one after the other, shape (height, width, 3) in bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_SIZE, _SIZE), dpi=_DPI)
    canvas = FigureCanvasAgg(figure)
    strip = figure.add_axes((0.1, 0.4, 0.8, 0.6), projection="3d")
    below = figure.add_axes((0.14, 0.1, 0.8, 0.3))
    curve(below, branch, [])
    (dot,) = below.plot([], [], "o", color="#000000", ms=9, zorder=4)
    for point in chosen:
        strip.clear()
        draw_strip(strip, branch.shape(point), width)
        dot.set_data([branch.points["kappa_n"][point]], [branch.points["kappa_star"][point]])
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _gif(frames: Iterable[np.ndarray]) -> bytes:
    from PIL import Image

    first, *others = [Image.fromarray(frame).quantize(128, dither=Image.Dither.NONE) for frame in frames]
    target = io.BytesIO()
    first.save(target, "GIF", save_all=True, append_images=others, duration=math.ceil(1000 / RATE), loop=0, disposal=1)
    return target.getvalue()


def _mp4(frames: Iterable[np.ndarray]) -> bytes:
    """The frames go through ffmpeg, by way of unnamed files: nothing is left behind by a process that is killed."""
    frames, dots = iter(frames), round(_SIZE * _DPI)
    words = ["-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{dots}x{dots}", "-r", f"{RATE}", "-i", "-"]
    # a pipe cannot be rewound, so the table of contents comes in parts
    words += ["-pix_fmt", "yuv420p", "-movflags", "frag_keyframe+empty_moov", "-f", "mp4", "-"]
    with tempfile.TemporaryFile() as pictures, tempfile.TemporaryFile() as result:
        program = _ffmpeg()
        for frame in frames:
            pictures.write(frame.tobytes())
        pictures.seek(0)
        done = subprocess.run([program, *words], stdin=pictures, stdout=result, stderr=subprocess.PIPE)
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().splitlines() or ["no reason given"]
            raise StoreError(f"ffmpeg could not write the film: {said[-1]}")
        result.seek(0)
        return result.read()


def _ffmpeg() -> str:
    """The program that writes MP4.

    Raises
    ------
    StoreError
        There is none; the sentence says what to install.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        try:
            import imageio_ffmpeg

            program = imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise StoreError(
                ".mp4 films are written by ffmpeg, which is not installed: pip install imageio-ffmpeg, or write a .gif"
            ) from error
    return program
