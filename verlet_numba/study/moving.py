"""Pictures one after another as a GIF or MP4 that takes as long as what it shows."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from verlet_numba.study.camera import Floats, Integers

HUNDREDTH = 0.01                                # s, what a GIF counts in
SHORTEST = {".gif": 0.02, ".mp4": 1 / 60}       # s a picture: browsers show those of a GIF that are shorter for a tenth of a second
QUALITY = ["-crf", "18", "-preset", "medium", "-movflags", "+faststart"]        # of x264: 0 is lossless, 23 its default
ROUNDING = 1e-9                                 # s


def clock(time: Floats) -> Floats:
    """(k,) s from the first picture on, of frames at these times (k,), in whatever order they are shown."""
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(time)))])


def apart(clock: Floats, shortest: float) -> list[int]:
    """The first picture, and every one that comes at least `shortest` after the last one kept."""
    kept = [0]
    for number, moment in enumerate(clock):
        if moment - clock[kept[-1]] > shortest - ROUNDING:
            kept.append(number)
    return kept


def delays(clock: Floats) -> Integers:
    """(k,) hundredths of a second that each picture of a GIF stays. Each ends at its rounded time, so that errors do not add up;
    the last stays as long as pictures do on the whole."""
    step = clock[-1] / (len(clock) - 1) if len(clock) > 1 else 1.0
    return np.diff(np.rint(np.append(clock, clock[-1] + step) / HUNDREDTH)).astype(np.int64)


def write_gif(pictures: list[Any], clock: Floats, title: str, output: Path) -> None:
    """Write Pillow images, each shown at its time (k,) s, as a GIF that starts again for ever."""
    from PIL import Image

    # One palette for all pictures, without dithering: what stands still does not flicker.
    sample = Image.new("RGB", (pictures[0].width, 3 * pictures[0].height))
    for place, picture in enumerate((pictures[0], pictures[len(pictures) // 2], pictures[-1])):
        sample.paste(picture, (0, place * picture.height))
    palette = sample.quantize(256, method=Image.Quantize.MEDIANCUT)
    pictures = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    pictures[0].save(output, save_all=True, append_images=pictures[1:], duration=(10 * delays(clock)).tolist(), loop=0,
                     comment=title.encode())


def beats(clock: Floats) -> tuple[float, Integers]:
    """Pictures a second of a film, and the picture (n,) that each of its frames shows: the latest that is due."""
    rate = 1 / np.diff(clock).min() if len(clock) > 1 else 1.0
    moments = np.arange(round(clock[-1] * rate) + 1) / rate
    return float(rate), np.searchsorted(clock, moments + 0.25 / rate, side="right") - 1


def write_mp4(pictures: Iterable[Any], clock: Floats, title: str, output: Path) -> None:
    """Write Pillow images, each shown at its time (k,) s, as H.264 that every browser plays; one at a time is held.

    Raises ImportError without imageio-ffmpeg, OSError if its ffmpeg fails.
    """
    from imageio_ffmpeg import write_frames

    rate, shown = beats(clock)
    film = None
    try:
        for picture, times in zip(pictures, np.bincount(shown, minlength=len(clock)), strict=True):
            width, height = picture.width // 2 * 2, picture.height // 2 * 2      # even, as half-size colours ask for
            if film is None:
                film = write_frames(str(output), (width, height), fps=rate, codec="libx264", quality=None, macro_block_size=1,
                                    output_params=[*QUALITY, "-metadata", f"title={title}"])
                film.send(None)
            for _ in range(times):
                film.send(picture.crop((0, 0, width, height)).tobytes())
    finally:
        if film is not None:
            film.close()
