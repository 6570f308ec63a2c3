"""Options of the commands that draw."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cyclopts import Group, Parameter

from slalom.cli.console import writing
from slalom.errors import InvalidInput

GROUP = Group("How figures look", sort_key=2)
FORMATS = (".svg", ".pdf", ".png")


@Parameter(name="*", group=GROUP)
@dataclass(frozen=True, kw_only=True)
class Look:
    """Size and text of figures.

    Parameters
    ----------
    figure_width
        Width [inch]; by default that of a page or of a column of a journal. Panels keep their shapes.
    font_scale
        Factor of all sizes of text.
    resolution
        Dots per inch of .png files.
    """

    figure_width: float | None = None
    font_scale: float = 1.0
    resolution: float = 300.0

    def __post_init__(self) -> None:
        from slalom.checks import positive

        for name in ("figure_width", "font_scale", "resolution"):
            if getattr(self, name) is not None:
                positive(getattr(self, name), f"--{name.replace('_', '-')}")

    def save(self, figure: Any, path: Path) -> Path:
        """Write a figure in this look. Raises InvalidInput for a width without space, InvalidFile as `writing`."""
        from slalom import view

        shown = view.resized(figure, width=self.figure_width, font_scale=self.font_scale)
        with writing(path):
            return view.save(shown, path, resolution=self.resolution)


def drawable(figure: Path | None) -> None:
    """Raise InvalidInput for a figure file of a format that cannot be drawn."""
    if figure is not None and figure.suffix not in FORMATS:
        raise InvalidInput(f"--figure: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")
