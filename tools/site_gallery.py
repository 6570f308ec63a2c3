"""The gallery of scenarios for the documentation site: each is run, drawn and exported while the site is built."""

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from site_units import meaning_of

import slalom
from slalom.base.errors import InvalidInput
from slalom.live.recorded import export
from slalom.peers import contender
from slalom.sim import gallery, simulate
from slalom.sim.gallery import GALLERY
from slalom.sim.measure.metrics import summary
from slalom.sim.sweep.case import SOURCES
from slalom.view.fleet import replay

METHOD: Final = "nao"
RESOLUTION: Final = 110.0
"""[dots per inch] of the pictures."""
INTERVAL: Final = 1.0
"""[s] between two control spaces of a player. Smaller: larger files; 1 s makes 50 to 300 kB a run."""
PLAYER: Final = """<details class="player"><summary>Play this run</summary>
<iframe src="{address}" loading="lazy" title="A player of {name}"></iframe>
<p><a href="{address}">In a window of its own</a></p></details>"""
"""The player of a run in the page. It is loaded when it is opened."""


def page(picture: Callable[[str], tuple[str, str]]) -> str:
    """Return the page: for each scenario its description, parameters, command, result and picture.

    Args:
        picture: address of the picture of a scenario, "" for none, and a sentence on its run.
    """
    lines = [
        "# Gallery of scenarios",
        f"This page shows every scenario of the gallery, run with `{METHOD}` and seed 0. The pictures are made while "
        "the site is built. With one robot they show the decision before the closest approach, with several the tracks "
        "of all. A player shows a run with the control spaces of its first robot, one for each second; "
        "[the view](../view.md) describes it.",
    ]
    for name, entry in GALLERY.items():
        address, sentence = picture(name)
        parameters = [f"- `{key}`, {value:g}: {meaning_of(name, key)}" for key, value in entry.parameters.items()]
        command = " ".join(["slalom run", name, "--figure", f"{name}.png"])
        lines += [f"## {name}", f"{entry.sentence} {sentence}"]
        lines += ["Parameters, with their defaults:", "\n".join(parameters)] if parameters else []
        lines += [f"```console\n$ {command}\n```"]
        if address:
            player = str(Path(address).with_suffix(".html"))
            lines += [f"![A run of {name}]({address})", PLAYER.format(address=player, name=name)]
    return "\n\n".join(lines) + "\n"


def drawn(name: str, folder: Path) -> tuple[str, str]:
    """Return the name of the picture of a scenario in a folder, and a sentence on the run; write its player beside it.

    All are made again only after a change of the code. The name is "" where the scenario cannot be built.
    """
    target = folder / f"gallery_{name}.png"
    player, text = target.with_suffix(".html"), target.with_suffix(".txt")
    digest = _digest()
    if all(path.exists() for path in (target, player, text)) and text.read_text().startswith(digest):
        return target.name, text.read_text().partition("\n")[2]
    try:
        scenario = gallery.build(name)
    except InvalidInput as error:
        # A scenario whose people move by a package of another project.
        return "", f"Not drawn here: {error}."
    recording = simulate(scenario, contender(METHOD))
    folder.mkdir(parents=True, exist_ok=True)
    slalom.view.save(replay(recording, scenario, METHOD), target, resolution=RESOLUTION)
    export(recording, player, interval=INTERVAL)
    sentence = _sentence(summary(recording))
    text.write_text(f"{digest}\n{sentence}")
    return target.name, sentence


def _sentence(result: Mapping[str, object]) -> str:
    robots, there, hit = result["robots"], result["arrived"], result["collisions"]
    ends = f"after {result['time']:.1f} s" if robots == there else f"within {result['time']:.1f} s"
    arrivals = "The robot arrived" if robots == there == 1 else f"{there} of {robots} robots arrived"
    return f"{arrivals} {ends}, {'with' if hit else 'without'} a collision."


def _digest() -> str:
    found = hashlib.sha256(SOURCES.encode())
    package = Path(slalom.__file__).parent
    for path in (Path(__file__), package / "live/renderer/view.js", *sorted((package / "view").glob("*.py"))):
        found.update(path.read_bytes())
    return found.hexdigest()
