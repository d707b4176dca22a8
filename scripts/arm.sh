#!/usr/bin/env bash
# Usage: scripts/arm.sh ACTION OBJECT [--network] [--domain N]
#
# Lets the robot of a running cell do one action to one object.
#
#   ACTION       place_left, place_right, place_offtable, push_left, push_right or push_offtable
#   OBJECT       pear, lemon or chicken
#   --network    look for the cell on other machines of the subnet too
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Example: scripts/arm.sh push_left pear
# Exit codes: 0 the motion was completed, 1 it was not, 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.cell_commands:arm "$@"
