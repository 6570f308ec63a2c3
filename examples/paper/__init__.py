"""The figures and claims of the paper, made with slalom: `python -m examples.paper`. docs/paper.md is its page."""
