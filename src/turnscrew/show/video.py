"""The film of a run, drawn from its record: `python -m turnscrew.show.video DIR` in a process that may use OpenGL."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.errors import RenderError, TurnscrewError
from turnscrew.geometry.arrays import Array
from turnscrew.plant.log import read_log
from turnscrew.plant.replay import load_model
from turnscrew.show import gl
from turnscrew.task.signal_table import read_signals

if TYPE_CHECKING:
    import PIL.Image

VIDEO = "video.mp4"
WIDTH, HEIGHT, RATE = 854, 480, 30
"""480p at 30 frames a second: a software renderer draws it faster than 720p by half, and hand and slot are clear."""


def film(folder: Path) -> Path:
    """Draws a run's video in a process of its own.

    Returns:
        Where the video lies.

    Raises:
        RecordError: The folder holds no run.
        RenderError: It could not be drawn.
    """
    read_log(folder)
    command = [sys.executable, "-m", "turnscrew.show.video", str(folder)]
    drawn = subprocess.run(command, env=gl.environment(), capture_output=True, text=True)
    if drawn.returncode:
        lines = drawn.stderr.strip().splitlines()
        raise RenderError(lines[-1] if lines else f"the drawing process ended with status {drawn.returncode}")
    return folder / VIDEO


def draw(folder: Path, width: int = WIDTH, height: int = HEIGHT) -> None:
    """Writes `video.mp4` into a run's folder, in this process.

    Args:
        folder: A run's record, whole or not.
        width: Of the picture, even [px].
        height: Of the picture, even [px].
    """
    import av

    from turnscrew.show.scene import Scene

    states, captions = _states(folder)
    aside = folder / f".{VIDEO}.part"
    with Scene(folder, width, height) as scene, av.open(str(aside), "w", format="mp4") as container:
        stream = container.add_stream("h264", rate=RATE, options={"crf": "24", "preset": "veryfast"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for qpos, caption in zip(states, captions, strict=True):
            image = _captioned(scene.draw(qpos), caption)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())
    os.replace(aside, folder / VIDEO)


def cut(video: Path, target: Path, start: float, seconds: float, width: int = 480, rate: int = 12) -> None:
    """Writes a piece of a video as an animated WebP, for a page that plays no mp4.

    Args:
        video: An mp4.
        target: The WebP.
        start: Where the piece begins [s].
        seconds: How long it is [s].
        width: Of the picture [px].
        rate: Frames a second.

    Raises:
        RenderError: The video cannot be read or holds no such piece.
    """
    pieces = list(_pieces(video, start, seconds, width, rate))
    if not pieces:
        raise RenderError(f"{video}: holds nothing from {start:g} s on")
    pieces[0].save(
        target, save_all=True, append_images=pieces[1:], duration=round(1000 / rate), loop=0, quality=55, method=4
    )


def _pieces(video: Path, start: float, seconds: float, width: int, rate: int) -> Iterator[PIL.Image.Image]:
    import av

    # frame times are rounded to the container's clock: a frame that is early by less than that is due
    due = start - 0.5 / RATE
    try:
        with av.open(str(video)) as container:
            for frame in container.decode(video=0):
                if frame.time is not None and due <= frame.time < start + seconds:
                    due += 1 / rate
                    image: PIL.Image.Image = frame.to_image()  # type: ignore[no-untyped-call]
                    yield image.resize((width, round(image.height * width / image.width)))
    except OSError as error:
        raise RenderError(f"{video}: cannot be read: {error.strerror or error}") from None


def _states(folder: Path) -> tuple[Array, list[str]]:
    """Joint positions at each frame, and what to write on it."""
    log = read_log(folder)
    count = max(1, round((log.time[-1] - log.time[0]) * RATE))
    times = log.time[0] + np.arange(count) / RATE
    rows = np.searchsorted(log.time, times).clip(max=len(log.time) - 1)
    model = load_model(folder)
    yaw = log.qpos[:, int(model.joint("screw").qposadr[0])]
    turned = -np.degrees(yaw[rows] - yaw[0])
    signals = read_signals(folder)
    ticks = np.searchsorted(signals["time"], times).clip(max=len(signals["time"]) - 1) if signals else rows * 0
    rounds = signals["goal.round"][ticks] if "goal.round" in signals else None
    phases = signals["goal.phase"][ticks] if "goal.phase" in signals else None
    captions = []
    for index, time in enumerate(times):
        words = [] if rounds is None else [f"round {int(rounds[index]) + 1}"]
        words += [f"screw {turned[index]:.0f} deg", f"{time:.1f} s"]
        words += [] if phases is None else [str(phases[index])]
        captions.append("   ".join(words))
    return log.qpos[rows], captions


def _captioned(image: np.ndarray, caption: str) -> np.ndarray:
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.fromarray(image)
    font = ImageFont.load_default(size=max(12, image.shape[0] // 22))
    pen = ImageDraw.Draw(picture)
    pen.text((14, 10), caption, font=font, fill=(25, 30, 40), stroke_width=2, stroke_fill=(255, 255, 255))
    return np.asarray(picture)


def main() -> int:
    """Draws the video of the folder named on the command line; 2 and one line when it cannot."""
    try:
        draw(Path(sys.argv[1]))
    except (TurnscrewError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
