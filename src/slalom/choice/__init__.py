"""Control obstacles, their exact boundary, and the exact choice of a control outside them."""
