#!/usr/bin/env bash
# Usage: scripts/stop.sh [--by NAME] [--network] [--domain N]
#
# Connects to a running cell and waits: any key stops every motion at once, Ctrl-C leaves. The cell stays held,
# also across restarts of its processes, until `scripts/cell.sh resume`.
#
#   --by NAME    who stops (default: the user name)
#   --network    stop a cell on other machines of the subnet too
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Software alone: keep a hardware emergency stop within reach of a real arm.
# Exit codes: 0 left, 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_arm.ros.stop_command "$@"
