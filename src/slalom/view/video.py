"""Videos of pictures, encoded by PyAV."""

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from slalom.errors import InvalidInput
from slalom.sim import Recording
from slalom.view.film import Film, Pixels

FORMATS: Final[dict[str, dict[str, Any]]] = {
    ".mp4": {"codec": "libx264", "pix_fmt": "yuv420p", "options": {"crf": "23", "preset": "veryfast"}},
    ".gif": {"codec": "gif", "pix_fmt": "pal8", "options": {}},
}
"""Encoder, pixel format and options by suffix."""
PALETTE_FROM: Final = 12
"""[1] Pictures from which the 256 colours of a GIF are taken."""


def animate(
    recording: Recording,
    path: Path | str,
    *,
    width: int = 720,
    fps: float = 25.0,
    speed: float = 1.0,
    trail: float = 3.0,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a video of a run: robots, obstacles, goals and trails in the workspace.

    In space the run is seen from above and from the side. Robots that need not stop leave the picture at their goal.

    Args:
        path: a name ending in .mp4 or .gif. width: [pixel], even; the height follows from the run.
        fps: [1/s] pictures in a second of video. speed: seconds of the run in a second of video.
        trail: [s] of the run behind each robot that is drawn as a line. progress: called with the share that is done.

    Raises:
        InvalidInput: a run without a step, another suffix, a setting outside its limits, or PyAV is not installed
            (`pip install 'slalom[video]'`).
    """
    target = checked(path)
    return write_video(target, Film(recording, width=width, fps=fps, speed=speed, trail=trail), fps, progress)


def checked(path: Path | str) -> Path:
    """Return the path of a video. Raises InvalidInput for another suffix, or if PyAV is not installed."""
    target = Path(path)
    if target.suffix not in FORMATS:
        raise InvalidInput(f"path: expected a name ending in {' or '.join(FORMATS)}, found {str(path)!r}")
    _library()
    return target


def write_video(
    path: Path, pictures: Sequence[Pixels], fps: float, progress: Callable[[float], None] | None = None
) -> Path:
    """Write pictures (height, width, 3), both sides even and all of one size, at `fps` [1/s], see `animate`."""
    av, options = _library(), FORMATS[path.suffix]
    rate = Fraction(fps).limit_denominator(1000)
    with av.open(str(path), "w", options={"movflags": "+faststart"} if path.suffix == ".mp4" else {}) as file:
        stream = file.add_stream(options["codec"], rate=rate, options=options["options"])
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.codec_context.time_base = options["pix_fmt"], 1 / rate
        frames = _frames(av, pictures, rate, progress)
        for frame in _with_palette(av, frames, pictures, rate) if path.suffix == ".gif" else frames:
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    return path


def _library() -> ModuleType:
    try:
        import av
        import av.filter
    except ModuleNotFoundError as error:
        needed = "expected the packages of `pip install 'slalom[video]'`"
        raise InvalidInput(f"animate: {needed}, found no {error.name}") from None
    return av


def _frames(
    av: ModuleType, pictures: Sequence[Pixels], rate: Fraction, progress: Callable[[float], None] | None
) -> Iterator[Any]:
    for k in range(len(pictures)):
        yield _frame(av, pictures[k], k, rate)
        if progress:
            progress((k + 1) / len(pictures))


def _frame(av: ModuleType, picture: Pixels, k: int, rate: Fraction) -> Any:
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
    frame.pts, frame.time_base = k, 1 / rate
    return frame


def _with_palette(av: ModuleType, frames: Iterator[Any], pictures: Sequence[Pixels], rate: Fraction) -> Iterator[Any]:
    """Frames in the 256 colours that fit some of the pictures best, without dithering, which would flicker."""
    some = np.unique(np.linspace(0, len(pictures) - 1, PALETTE_FROM).astype(int)).tolist()
    first = _frame(av, pictures[0], 0, rate)
    finding = av.filter.Graph()
    source = finding.add_buffer(width=first.width, height=first.height, format=first.format, time_base=1 / rate)
    sink = finding.add("buffersink")
    _link(source, finding.add("palettegen", "reserve_transparent=0"), sink)
    finding.configure()
    for number, k in enumerate(some):
        source.push(_frame(av, pictures[k], number, rate))
    source.push(None)
    palette = sink.pull()
    using = av.filter.Graph()
    source = using.add_buffer(width=first.width, height=first.height, format=first.format, time_base=1 / rate)
    colours = using.add_buffer(
        width=palette.width, height=palette.height, format=palette.format, time_base=palette.time_base
    )
    mapping, sink = using.add("paletteuse", "dither=none:diff_mode=rectangle"), using.add("buffersink")
    source.link_to(mapping, 0, 0)
    colours.link_to(mapping, 0, 1)
    mapping.link_to(sink)
    using.configure()
    colours.push(palette)
    colours.push(None)
    for frame in frames:
        source.push(frame)
        yield from _pulled(av, sink)
    source.push(None)
    yield from _pulled(av, sink)


def _link(*steps: Any) -> None:
    for before, after in pairwise(steps):
        before.link_to(after)


def _pulled(av: ModuleType, sink: Any) -> Iterator[Any]:
    """The frames that a graph has ready."""
    while True:
        try:
            yield sink.pull()
        except (av.error.BlockingIOError, av.error.EOFError):
            return
