"""`slalom list`."""

from typing import Literal

from slalom.cli.console import DONE, Flag, answer
from slalom.report import list_text


def list_(what: Literal["scenarios", "methods", "figures"] | None = None, /, *, json: Flag = False) -> int:
    """List the scenarios of the gallery, the methods, and the paper's figures and claims.

    Parameters
    ----------
    what
        Only these.
    json
        Print one JSON object.
    """
    from slalom.peers import CONTENDERS
    from slalom.reproduce.titles import TITLES
    from slalom.sim.gallery import GALLERY

    scenarios = {e.name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for e in GALLERY.values()}
    methods = {m.name: {"sentence": m.sentence, "source": m.source} for m in CONTENDERS.values()}
    figures = {name: {"sentence": f"{title}."} for name, title in TITLES.items()}
    every = (("scenarios", scenarios), ("methods", methods), ("figures", figures))
    result = {k: v for k, v in every if what in (None, k)}
    answer(result, json, lambda: list_text(result))
    return DONE
