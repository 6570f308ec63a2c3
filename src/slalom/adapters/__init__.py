"""slalom inside other projects: one module for each, which imports that project's package."""
