"""A branch as a film: the strip as it folds, above the curve on which a dot moves."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from branches.draw.picture import panel, scale_bar, weight_arrow
from branches.draw.strip import View, draw_strip, places, reach_of
from branches.store.files import StoreError
from contin.lowlevel import Colour

#: Frames a second. Ten times more is faster than a person sees, and GIF has no more than 50.
RATE = 16
#: Side of a frame in inches, and dots per inch: 480 dots for web pages, 960 for MP4, which compresses better and wants even
#: numbers; ten times more dots would make files of hundreds of megabytes.
_SIZE, _DPI = 6.4, {".gif": 75, ".mp4": 150}
#: Colours of a GIF, as many as it can have; with half as many, the shades of the strip are bands.
_COLOURS = 256
#: How long a GIF rests at both ends of the branch, in frames.
_REST = 6


def film(
    branch, ending: str, frames: int, width: float | None = None, view: tuple[float, float] | None = None
) -> bytes:  # fmt: skip
    """The film of a branch, as the content of a file; a GIF goes back the way it came and begins again.

    Raises StoreError where the branch keeps fewer than two solutions, or what writes this format is not installed.

    Parameters
    ----------
    branch : branches.store.branch.StoredBranch
    ending : str
        ".gif" or ".mp4".
    frames : int
        From one end of the branch to the other, at most so many; the strip moves as far from each to the next. Each shows a
        point whose solution is kept.
    width : float, optional
        Width of the drawn strip, in units of L/2 pi; see `branches.store.branch.StoredBranch.drawn_width`.
    view : (float, float), optional
        The side from which the strip is seen, as of `branches.draw.picture.figure`.
    """
    kept = branch.kept().tolist()
    if len(kept) < 2:
        raise StoreError(f"a film needs 2 points whose solutions are kept, and there are {len(kept)}")
    strips = branch.posed(kept)
    chosen = {point: strips[point] for point in evenly(strips, frames)}
    write = {".gif": _gif, ".mp4": _mp4}[ending]
    seen = branch.view if view is None else View(*view)
    return write(drawn(branch, chosen, branch.drawn_width([*chosen.values()], width), _DPI[ending], seen))


def evenly(strips: dict, count: int) -> list[int]:
    """Of points with their strips, those between which the strip moves as far: at most ``count``, both ends among them."""
    found = [places(strip) for strip in strips.values()]
    steps = [np.sqrt(np.mean(np.sum((b - a) ** 2, axis=1))) for a, b in pairwise(found)]
    way = np.append(0.0, np.cumsum(steps))
    nearest = [int(np.argmin(np.abs(way - place))) for place in np.linspace(0, way[-1], count)]
    return [list(strips)[number] for number in dict.fromkeys(nearest)]


def drawn(branch, strips: dict, width: float, dpi: int, view: View) -> Iterator[np.ndarray]:
    """Pictures of the strips at points of a branch, one after the other, shape (height, width, 3) in bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure, reach = Figure(figsize=(_SIZE, _SIZE), dpi=dpi), reach_of(strips.values(), width, view)
    canvas = FigureCanvasAgg(figure)
    above = figure.add_axes((0.22, 0.41, 0.57, 0.57))
    words: dict[str, Any] = {}
    graphs = {columns[0]: _graph(figure, branch, columns, words) for columns in branch.panels}
    figure.legend(words.values(), words.keys(), loc="upper left", frameon=False, fontsize=9)  # beside the strip
    for point, strip in strips.items():
        above.clear()
        draw_strip(above, strip, width, reach, view, round(0.57 * _SIZE * dpi))
        scale_bar(above, branch, reach)
        if branch.is_heavy:
            weight_arrow(above, reach, view)
        here = branch.followed(int(branch.stage_of[point]))
        for name, (below, dot, across, up) in graphs.items():
            below.set_visible(name == here)
            dot.set_data([across[point]], [up[point]])
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _graph(figure, branch, columns: tuple[str, str], words: dict[str, Any]) -> tuple[Any, Any, np.ndarray, np.ndarray]:
    """Draw the curve of a number that is followed; return its axes, the dot, and both columns. ``words`` are of the legend."""
    below = figure.add_axes((0.12, 0.09, 0.84, 0.26))
    panel(below, branch, columns, [], dots=False)  # a film is made of many points: their dots would hide the line
    for handle, word in zip(*below.get_legend_handles_labels()):
        words.setdefault(word, handle)
    below.get_legend().remove()
    below.set_title(branch.caption, fontsize=12)
    below.yaxis.label.set_size(9)  # it is longer than the axes are high
    (dot,) = below.plot([], [], "o", color="#000000", ms=11, mec="white", zorder=4)
    return below, dot, *(branch.axis(column)[0] for column in columns)


def _gif(frames: Iterable[np.ndarray]) -> bytes:
    """All frames and back, with one palette for all: a colour that does not change is not stored again."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    pictures = [Image.fromarray(frame) for frame in frames]
    side = pictures[0].size[0]
    sample = Image.new("RGB", (side, 3 * side))
    for number in range(3):
        sample.paste(pictures[number * (len(pictures) - 1) // 2], (0, number * side))
    marks = [round(255 * part) for colour in Colour for part in to_rgb(colour)]  # of few pixels: counted out, they would change
    palette = sample.quantize(_COLOURS - len(Colour))
    white, colours = palette.getpixel((0, 0)), [*palette.getpalette()[: 3 * (_COLOURS - len(Colour))], *marks]
    palette.putpalette([255 if i // 3 == white else value for i, value in enumerate(colours)])  # not the mean of near whites
    first, *others = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    others += others[-2::-1]
    times = [math.ceil(1000 / RATE)] * (1 + len(others))
    times[0] = times[len(pictures) - 1] = _REST * times[0]
    target = io.BytesIO()
    first.save(target, "GIF", save_all=True, append_images=others, duration=times, loop=0, disposal=1, optimize=False)
    return target.getvalue()


def _mp4(frames: Iterable[np.ndarray]) -> bytes:
    """The frames go through ffmpeg, by way of unnamed files: nothing is left behind by a process that is killed."""
    dots = round(_SIZE * _DPI[".mp4"])
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
    """Return the program that writes MP4; raise StoreError, which says what to install, where there is none."""
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
