"""`python -m swath`: the same as the command `swath`."""

import sys

from swath.cli import main

if __name__ == "__main__":
    sys.exit(main())
