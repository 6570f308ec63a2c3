"""Reproduction of the paper's figures and measurement of its claims; `slalom reproduce` on the command line.

Heavy modules are imported on use, so that the command line starts fast.
"""
