#!/usr/bin/env bash
# Usage: scripts/foxglove.sh [OPTION...]
#
# A live bridge to the Foxglove application, which needs no ROS: open the connection
# ws://localhost:8765 there and import the layout ros2_ws/src/likeme_bringup/config/foxglove_layout.json.
# The first run installs foxglove-sdk (about 20 MB) from scripts/foxglove.lock. Ctrl-C ends it.
#
#   --port N     TCP port (default: 8765)
#   --host A     address to listen on (default: 127.0.0.1, this host only; 0.0.0.0: all networks).
#                Who connects sees every topic, and can publish nothing.
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 ended, 1 could not install, 2 usage, 78 cannot listen on the port.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
"$here/setup.sh"
source "$here/env.sh"
lock=$LIKEME_ROOT/scripts/foxglove.lock state=$LIKEME_VENV/likeme/foxglove
if ! sha256sum --status --check "$state" 2>/dev/null; then
  "$LIKEME_VENV/uv/bin/uv" pip install -q --python "$LIKEME_VENV/bin/python" --no-deps \
    --require-hashes -r "$lock" || { echo "foxglove.sh: could not install scripts/foxglove.lock." >&2; exit 1; }
  # A new requirements.lock takes away what it does not name.
  sha256sum "$lock" "$LIKEME_ROOT/requirements.lock" >"$state"
fi
exec "$here/run.sh" python -m likeme_replay.foxglove_console "$@"
