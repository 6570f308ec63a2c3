"""Views of runs that move: in a browser, and as one file.

One renderer (`renderer/view.js`, from `web/`) draws both, fed by the messages of `messages.py`. docs/view.md describes
them.
"""
