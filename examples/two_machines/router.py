"""A Zenoh session as the router, for those who have no zenohd.

python router.py --config router.json5
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from pathlib import Path

import zenoh


def main() -> int:
    """Routes until SIGTERM or Ctrl-C, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--config", type=Path, default=Path("router.json5"))
    parser.add_argument("--listen", metavar="ENDPOINT", help="in place of the one in the file")
    arguments = parser.parse_args()
    ends = (signal.SIGINT, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    try:
        config = zenoh.Config.from_file(str(arguments.config))
        if arguments.listen:
            config.insert_json5("listen/endpoints", json.dumps([arguments.listen]))
        session = zenoh.open(config)
    except zenoh.ZError as error:
        print(f"router: {str(error).splitlines()[0]}", file=sys.stderr)
        return 2
    print(f"router ready: {json.loads(str(config.get_json('listen/endpoints')))[0]}", flush=True)
    signal.sigwait(ends)
    session.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
