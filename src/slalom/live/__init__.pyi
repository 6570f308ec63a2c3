"""The public names of slalom.live, each once."""

from .monitor import attach as attach
