"""Models of crowds, which predict how people move: no part in safety."""
