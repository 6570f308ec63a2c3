"""`slalom list`."""

import inspect
from collections.abc import Callable
from typing import Any, Final, Literal

from slalom.base.errors import InvalidInput
from slalom.cli.console import DONE, Flag, print_result
from slalom.cli.report import FORESIGHT_SENTENCES, list_text, with_values

Rows = dict[str, dict[str, Any]]


def list_(
    kind: Literal[
        "scenarios", "methods", "foresights", "metrics", "objectives", "formats", "figures", "samples", "keys"
    ]
    | None = None,
    part: str | None = None,
    /,
    *,
    json: Flag = False,
) -> int:
    """List scenarios, methods, foresights, metrics, objectives, formats of recordings, figures, sample files, and keys.

    Installed packages add scenarios, methods, metrics, objectives and formats by entry points.

    Parameters
    ----------
    kind
        List only entries of this kind. `keys` are those of scenario and study files, which are listed on request only.
    part
        With `keys`: list the keys of this part of a file with their values, as in `slalom list keys goal`.
    json
        Print one JSON object.
    """
    if part is not None and kind != "keys":
        raise InvalidInput(f"part: expected only with keys, found {part!r} with {kind}")
    if kind == "keys":
        from slalom.cli.file_keys import listed

        result = listed(part)
    else:
        result = {each: TABLES[each]() for each in TABLES if kind in (None, each)}
    print_result(result, json, lambda: list_text(result))
    return DONE


def _scenarios() -> Rows:
    from slalom.sim.gallery import GALLERY

    return {name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for name, e in GALLERY.items()}


def _methods() -> Rows:
    from slalom.peers import CONTENDERS, Peer

    return {
        name: {
            "sentence": m.sentence,
            "source": m.source,
            "foresight": m.foresight,
            **({"parameters": m.parameters} if isinstance(m, Peer) else {}),
        }
        for name, m in CONTENDERS.items()
    }


def _foresights() -> Rows:
    from slalom.forecast.forecast import FORESIGHTS, foresight_of

    return {
        name: {"sentence": FORESIGHT_SENTENCES[name], "level": foresight_of(rule)} for name, rule in FORESIGHTS.items()
    }


def _metrics() -> Rows:
    from slalom.sim.measure.metrics import METRICS

    return {name: {"sentence": with_values(_first_line(metric))} for name, metric in METRICS.items()}


def _objectives() -> Rows:
    from slalom.decision.objective import OBJECTIVES

    return {name: {"sentence": _first_line(objective)} for name, objective in OBJECTIVES.items()}


def _formats() -> Rows:
    from slalom.io.formats import FORMATS

    return {name: {"sentence": f.sentence, "mark": f.mark, "suffix": f.suffix} for name, f in FORMATS.items()}


def _figures() -> Rows:
    from slalom.paper.titles import TITLES

    return {name: {"sentence": f"{title}."} for name, title in TITLES.items()}


def _samples() -> Rows:
    from slalom.io.table import SAMPLES

    return {name: {"sentence": sentence} for name, sentence in SAMPLES.items()}


TABLES: Final[dict[str, Callable[[], Rows]]] = {
    "scenarios": _scenarios,
    "methods": _methods,
    "foresights": _foresights,
    "metrics": _metrics,
    "objectives": _objectives,
    "formats": _formats,
    "figures": _figures,
    "samples": _samples,
}
"""The lists, each imported on use."""


def _first_line(part: object) -> str:
    """The first line of the docstring of a function or class."""
    return (inspect.getdoc(part) or "").partition("\n")[0]
