#!/usr/bin/env bash
# Tries the example on one machine as if it were three: in namespaces of their own, with no other way between
# the server and the client than the router. Needs Linux, and no root where users may make namespaces.
#
#   ./in_namespaces.sh SERVER PYTHON [client.py's arguments]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

if [[ -z ${IN_NAMESPACES:-} ]]; then
  # A network, a file system table and process numbers that end with this script.
  IN_NAMESPACES=1 exec unshare --user --map-root-user --net --mount --pid --fork --kill-child "$BASH" "$PWD/in_namespaces.sh" "$@"
fi
server=$1 python=$2
shift 2

mount -t tmpfs tmpfs /run
ip link set lo up
for place in field:1 office:2; do
  name=${place%:*} net=10.77.${place#*:}
  ip netns add "$name"
  ip link add "to-$name" type veth peer name eth0 netns "$name"
  ip address add "$net.1/24" dev "to-$name"
  ip link set "to-$name" up
  ip -n "$name" address add "$net.2/24" dev eth0
  ip -n "$name" link set eth0 up
  ip -n "$name" link set lo up
done
# Nothing is forwarded: what gets from one to the other goes through the router.
if ip netns exec office "$python" -c 'import socket; socket.create_connection(("10.77.1.2", 7448), 1)' 2>/dev/null; then
  echo "in_namespaces: the office reaches the field without the router" >&2
  exit 1
fi

exec {router}< <(exec "$python" router.py)
read -r line <&"$router" && echo "$line"
exec {field}< <(exec ip netns exec field "$server" --config server.toml)
read -r line <&"$field" && echo "$line"
ip netns exec office "$python" client.py "$@"
