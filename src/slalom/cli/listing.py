"""`slalom list`."""

from typing import Literal

from slalom.cli.console import DONE, Flag, print_result
from slalom.cli.report import FORESIGHT_SENTENCES, list_text


def list_(
    kind: Literal["scenarios", "methods", "foresights", "formats", "figures", "samples"] | None = None,
    /,
    *,
    json: Flag = False,
) -> int:
    """List scenarios, methods, foresights, formats of recordings, figures of the paper, and files that slalom brings.

    Parameters
    ----------
    kind
        List only entries of this kind: scenarios, methods, foresights, formats, figures or samples.
    json
        Print one JSON object.
    """
    from slalom.forecast import FORESIGHTS, foresight_of
    from slalom.io.formats import FORMATS
    from slalom.io.tracks import SAMPLES
    from slalom.paper.titles import TITLES
    from slalom.peers import CONTENDERS
    from slalom.sim.gallery import GALLERY

    scenarios = {e.name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for e in GALLERY.values()}
    methods = {
        m.name: {"sentence": m.sentence, "source": m.source, "foresight": m.foresight} for m in CONTENDERS.values()
    }
    foresights = {
        name: {"sentence": FORESIGHT_SENTENCES[name], "level": foresight_of(rule)} for name, rule in FORESIGHTS.items()
    }
    formats = {f.name: {"sentence": f.sentence, "mark": f.mark, "suffix": f.suffix} for f in FORMATS.values()}
    figures = {name: {"sentence": f"{title}."} for name, title in TITLES.items()}
    samples = {name: {"sentence": sentence} for name, sentence in SAMPLES.items()}
    tables = (
        ("scenarios", scenarios),
        ("methods", methods),
        ("foresights", foresights),
        ("formats", formats),
        ("figures", figures),
        ("samples", samples),
    )
    result = {k: v for k, v in tables if kind in (None, k)}
    print_result(result, json, lambda: list_text(result))
    return DONE
