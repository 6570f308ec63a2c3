"""The paper's figures, and its claims beside what is measured here; `slalom reproduce` on the command line.

Everything heavy is imported when it is used, so that the command line answers at once.
"""
