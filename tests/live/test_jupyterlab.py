"""The player and the live widget in JupyterLab itself, in Chromium."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from live_views import in_browser, opened

CELLS = (
    "import slalom\nfrom slalom.live.notebook import widget\nfrom slalom.sim import gallery, simulate\n"
    "scene = gallery.build('head_on', {'duration': 1.0})\nsimulate(scene, 'nao')",
    "widget(scene, slalom.method('nao'), live=True)",
)
"""The page that a recording shows of itself, and a live widget."""


@contextmanager
def lab(folder: Path) -> Iterator[str]:
    """The address of a JupyterLab whose folder holds a notebook with CELLS."""
    cells = [
        {"cell_type": "code", "id": f"c{k}", "metadata": {}, "outputs": [], "execution_count": None, "source": source}
        for k, source in enumerate(CELLS)
    ]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    notebook = {"nbformat": 4, "nbformat_minor": 5, "metadata": kernel, "cells": cells}
    (folder / "view.ipynb").write_text(json.dumps(notebook))
    options = ["--no-browser", "--allow-root", "--port=0", "--ServerApp.token=t", f"--ServerApp.root_dir={folder}"]
    options += ["--LabApp.news_url=None", "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate"]
    command = [sys.executable, "-m", "jupyterlab", *options]
    own = {"JUPYTER_CONFIG_DIR": folder / "config", "JUPYTER_DATA_DIR": folder / "data"}
    own |= {"JUPYTER_RUNTIME_DIR": folder / "runtime", "IPYTHONDIR": folder / "ipython"}
    environment = {**os.environ, **{name: str(path) for name, path in own.items()}}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment, cwd=folder)
    assert process.stderr is not None
    try:
        said = []
        for line in process.stderr:
            said.append(line)
            if found := re.search(r"http://(?:localhost|127\.0\.0\.1):(\d+)/", line):
                break
        else:
            pytest.fail("JupyterLab did not start: " + "".join(said[-20:]))
        yield f"http://127.0.0.1:{found[1]}/lab/tree/view.ipynb?token=t"
    finally:
        process.terminate()
        process.stderr.close()
        process.wait(30)


def renderer(frame: Any) -> Any:
    """The element of the view in a frame, once it has drawn a control space."""
    found = frame.locator("canvas").first
    found.wait_for(state="visible", timeout=120_000)
    return found


@pytest.mark.slow
@pytest.mark.browser
@in_browser
@pytest.mark.skipif(find_spec("jupyterlab") is None, reason="jupyterlab is not installed: notebooks are not opened")
def test_a_notebook_in_jupyterlab_shows_the_player_and_the_live_widget(tmp_path: Path) -> None:
    """Both draw; with another method in the widget, the kernel makes the run again."""
    pytest.importorskip("anywidget", reason="slalom[notebook] is not installed: widgets are not made")
    with lab(tmp_path) as address, opened(viewport={"width": 1400, "height": 1600}) as (page, _):
        page.goto(address)
        page.locator(".jp-Notebook").wait_for(timeout=120_000)
        # Cells that are run before the kernel is ready open a dialog, which asks for a kernel, and then run.
        page.add_locator_handler(page.locator(".jp-Dialog button.jp-mod-accept"), lambda button: button.click())
        page.get_by_text("Python 3 (ipykernel) | Idle").wait_for(timeout=120_000)
        page.get_by_role("menuitem", name="Run", exact=True).click()
        page.get_by_role("menuitem", name="Run All Cells", exact=True).click()
        page.locator(".jp-OutputArea-output iframe").click(timeout=120_000)
        player = page.frame_locator(".jp-OutputArea-output iframe")
        renderer(player)
        assert "head_on" in player.locator(".slalom header").inner_text()
        live = page.locator(".jp-OutputArea-output .slalom").last
        renderer(live)
        assert "head_on" in live.locator("header").inner_text()
        live.locator("select").first.select_option("vo")
        live.locator(".why").filter(has_text="velocity").wait_for(timeout=60_000)
