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
source "$here/extra.bash"
install_extra scripts/foxglove.lock
run_program likeme_replay.foxglove_console "$@"
