"""Options of the commands that draw."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from cyclopts import Group, Parameter

from slalom.cli.console import writing
from slalom.errors import InvalidInput

GROUP = Group("How figures look", sort_key=2)
FORMATS = (".svg", ".pdf", ".png")
OPTIONS = {"width": "--figure-width", "resolution": "--resolution"}
"""Options of the arguments of the functions that size and write figures, for messages."""


RESOLUTION: Final = 300.0
"""Dots per inch, by default."""


@Parameter(name="*", group=GROUP)
@dataclass(frozen=True, kw_only=True)
class VectorLook:
    """Size and text of figures without pixels.

    Parameters
    ----------
    figure_width
        Width [inch]; by default that of a page or of a column of a journal. Panels keep their shapes.
    font_scale
        Factor of all sizes of text.
    """

    figure_width: float | None = None
    font_scale: float = 1.0

    def __post_init__(self) -> None:
        from slalom.checks import positive

        for item in fields(self):
            if getattr(self, item.name) is not None:
                positive(getattr(self, item.name), f"--{item.name.replace('_', '-')}")

    @property
    def dots(self) -> float:
        """Dots per inch of what is drawn as pixels."""
        return RESOLUTION

    def save(self, figure: Any, path: Path) -> Path:
        """Write a figure in this look. Raises InvalidInput for a width without space, InvalidFile as `writing`."""
        from slalom import view

        try:
            shown = view.resized(figure, width=self.figure_width, font_scale=self.font_scale)
            with writing(path):
                return view.save(shown, path, resolution=self.dots)
        except InvalidInput as error:
            name, _, text = str(error).partition(":")
            raise InvalidInput(f"{OPTIONS.get(name, name)}:{text}") from None


@Parameter(name="*", group=GROUP)
@dataclass(frozen=True, kw_only=True)
class Look(VectorLook):
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

    resolution: float = RESOLUTION

    @property
    def dots(self) -> float:
        return self.resolution


def drawable(figure: Path | None) -> None:
    """Raise InvalidInput for a figure file of a format that cannot be drawn."""
    if figure is not None and figure.suffix not in FORMATS:
        raise InvalidInput(f"--figure: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")


def refuse_without(figure: Path | None, look: Look | None, **options: object) -> None:
    """Raise InvalidInput for options of a figure that is not drawn: those that are not None or False."""
    if figure is not None:
        return
    looks = [] if look is None else [item.name for item in fields(look) if getattr(look, item.name) != item.default]
    given = [name for name, value in options.items() if value is not None and value is not False]
    for name in [*given, *looks]:
        raise InvalidInput(f"--{name.replace('_', '-')}: expected only with --figure, found it without")
