"""Views of runs that move: in a browser, and as one file.

One renderer (`renderer/view.js`, from `web/`) draws both, fed by the messages of `messages.py`. docs/view.md describes
them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
