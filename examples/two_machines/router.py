"""A Zenoh session as the router, for those who have no zenohd.

python router.py --config router.json5
"""

from __future__ import annotations

import argparse
import json
import re
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
    problem = f"`--config` must be a file with settings of Zenoh, got {arguments.config}"
    try:
        config = zenoh.Config.from_file(str(arguments.config))
        if arguments.listen:
            problem = f"`--listen` must be an endpoint such as tls/0.0.0.0:7447, got {arguments.listen}"
            config.insert_json5("listen/endpoints", json.dumps([arguments.listen]))
        endpoints = json.loads(str(config.get_json("listen/endpoints")))
        if not isinstance(endpoints, list) or not endpoints:
            print(f"router: `listen.endpoints` must be a list of endpoints in {arguments.config}", file=sys.stderr)
            return 2
        problem = f"cannot start at {endpoints[0]}"
        session = zenoh.open(config)
    except zenoh.ZError as error:
        # Where in Zenoh's own code it went wrong is of no use here.
        reason = re.sub(r" at /\S+:\d+\.?", "", " ".join(str(error).split()))
        print(f"router: {problem}: {reason}", file=sys.stderr)
        return 2
    print(f"router ready: {endpoints[0]}", flush=True)
    signal.sigwait(ends)
    session.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
