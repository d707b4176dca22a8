#!/usr/bin/env bash
# Usage: scripts/allow.sh [--network] [--domain N]
#
# Step mode of a real arm (start_cell.sh --arm CONFIG --step): shows each planned motion before it begins,
# y lets the arm do it, n ends the request. Ctrl-C leaves; nothing moves then.
#
#   --network    an arm on another machine of the subnet
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 left, 2 usage, 3 no arm in step mode is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_arm.ros.allow_command "$@"
