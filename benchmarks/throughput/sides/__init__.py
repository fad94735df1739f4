"""One process a side: each reads a case a line, measures it once and prints a line of JSON."""
