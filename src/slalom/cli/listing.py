"""`slalom list`."""

import inspect
from typing import Literal

from slalom.cli.console import DONE, Flag, print_result
from slalom.cli.report import FORESIGHT_SENTENCES, list_text


def list_(
    kind: Literal["scenarios", "methods", "foresights", "metrics", "objectives", "formats", "figures"] | None = None,
    /,
    *,
    json: Flag = False,
) -> int:
    """List scenarios, methods, foresights, metrics, objectives, formats of recordings, and figures of the paper.

    Installed packages add scenarios, methods, metrics, objectives and formats by entry points.

    Parameters
    ----------
    kind
        List only entries of this kind.
    json
        Print one JSON object.
    """
    from slalom.forecast import FORESIGHTS, foresight_of
    from slalom.io.formats import FORMATS
    from slalom.objective import OBJECTIVES
    from slalom.paper.titles import TITLES
    from slalom.peers import CONTENDERS
    from slalom.sim.gallery import GALLERY
    from slalom.sim.measure.metrics import METRICS

    scenarios = {e.name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for e in GALLERY.values()}
    methods = {
        m.name: {"sentence": m.sentence, "source": m.source, "foresight": m.foresight} for m in CONTENDERS.values()
    }
    foresights = {
        name: {"sentence": FORESIGHT_SENTENCES[name], "level": foresight_of(rule)} for name, rule in FORESIGHTS.items()
    }
    metrics = {name: {"sentence": _first_line(metric)} for name, metric in METRICS.items()}
    objectives = {name: {"sentence": _first_line(objective)} for name, objective in OBJECTIVES.items()}
    formats = {f.name: {"sentence": f.sentence, "mark": f.mark, "suffix": f.suffix} for f in FORMATS.values()}
    figures = {name: {"sentence": f"{title}."} for name, title in TITLES.items()}
    tables = (
        ("scenarios", scenarios),
        ("methods", methods),
        ("foresights", foresights),
        ("metrics", metrics),
        ("objectives", objectives),
        ("formats", formats),
        ("figures", figures),
    )
    result = {k: v for k, v in tables if kind in (None, k)}
    print_result(result, json, lambda: list_text(result))
    return DONE


def _first_line(part: object) -> str:
    """The first line of the docstring of a function or class."""
    return (inspect.getdoc(part) or "").partition("\n")[0]
