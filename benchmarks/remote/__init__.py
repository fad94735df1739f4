"""What it costs to step environments on a server of this machine; `make bench-remote` measures it."""
