"""Views of runs that move: in a browser, as one file, in a notebook, as a video.

One renderer (`renderer/view.js`, from `web/`) draws all of them but the video, fed by the messages of `messages.py`.
They are described in docs/view.md.
"""
