#!/usr/bin/env bash
# Usage: scripts/cell.sh reset [OBJECT=STATE...] [--seed N] | hold | resume | status [--json]
#                        [--network] [--domain N]
#
# reset: sets the simulated table up anew. Objects that are not named keep their place; with none
#        named, all go back to where this run of the cell had them first.
# hold: stops every motion at once; the interrupted action reports so.   resume: goes on.
# status: says in one line whether motion is allowed, how each node is, and what is open; exit code 0 only
#         if all nodes are ready and motion is allowed.
#
#   OBJECT=STATE  e.g. pear=left; states are left, right and offtable
#   --seed N      draws the exact places; the same seed gives the same table
#   --json        status as one JSON document
#   --network     look for the cell on other machines of the subnet too
#   --domain N    ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Example: scripts/cell.sh reset pear=left lemon=right --seed 3
# Exit codes: 0 done, 1 refused or not in service, 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.cell_commands:cell "$@"
