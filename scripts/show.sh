#!/usr/bin/env bash
# Usage: scripts/show.sh OBJECT FROM TO [--by MANNER] [--force] [--network] [--domain N]
#
# Lets the simulated person show the robot an act: move OBJECT from one state to another.
#
#   OBJECT       an object of the world, e.g. pear
#   FROM, TO     regions of the world, e.g. left and right; FROM must be where the camera sees it
#   --by MANNER  place (lift it, the default), push, or drop where the world has it
#   --force      go on even if the camera sees it elsewhere
#   --network    look for the cell on other machines of the subnet too
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Example: scripts/show.sh pear left right --by push
# Exit codes: 0 the motion was completed, 1 it was not, 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.cell_commands:show "$@"
