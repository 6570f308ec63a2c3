"""For a lecture: two runs side by side, a page for the web, and a notebook that shows a run.

The page needs no server and no slalom: put it on the web, and hand out the link. Further links are on the page
"Explore" of the documentation, where students drag obstacles.
"""

import json
from pathlib import Path
from tempfile import mkdtemp

from slalom.live.recorded import export
from slalom.sim import gallery, simulate
from slalom.view import save, sets

folder = Path(mkdtemp())
scene = gallery.build("roundabout_crossing", {"duration": 8.0}, seed=3)
for name in ("vo", "nao"):
    run = simulate(scene, name, seed=3)
    run.save(folder / f"{name}.h5")
export(run, folder / "nao.html", interval=0.5)
save(sets(scene, methods=("vo", "nao")), folder / "slide.pdf")

source = f"from slalom.sim import Recording\n\nRecording.load({str(folder / 'nao.h5')!r})"
cell = {"cell_type": "code", "id": "run", "metadata": {}, "source": source, "outputs": [], "execution_count": None}
notebook = {"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [cell]}
(folder / "lecture.ipynb").write_text(json.dumps(notebook))
print(f"slalom view {folder / 'vo.h5'} {folder / 'nao.h5'}   # both runs at the same time; e: lecture")
print(f"{(folder / 'nao.html').as_uri()}   # the page; jupyter lab {folder / 'lecture.ipynb'}")
