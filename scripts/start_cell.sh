#!/usr/bin/env bash
# Usage: scripts/start_cell.sh [OPTION...]
#
# Starts the cell in the foreground: arm driver (with the simulated cell), perception, inference.
# Ctrl-C ends every process, and so does SIGINT or SIGTERM, also when a script has started the cell
# with `&`; under nohup it outlives the terminal. A node that dies is started again: at once, then after
# growing pauses; the fifth death in a row, each within 30 s of a start, ends all with exit code 1. So
# does a node that refuses its parameters, or that somebody told to stop.
#
#   --only PART               start this part alone: arm, perception or inference; may be repeated
#   --simulate PART           simulate this part alone: arm, person or camera; may be repeated. The others
#                             are real: start their drivers yourself
#   --no-respawn              end all when a node dies
#   --network                 let nodes on other machines of the subnet take part (default: this host)
#   --mode MODE               how the robot imitates: trajectory, goal_based, interactive or sequential
#   --threshold P             ask for help below this predicted success, 0 to 1
#   --actions N               budget of the sequential mode: act, look again, act again (default: 3)
#   --seed N                  seed of the simulated cell
#   --real-time-factor F      1: real time; 0: as fast as possible
#   --model FILE              another transition model of the robot
#   --world W                 a shipped world (chung2015, three_bins, one_more_manner) or a world file
#   --arm CONFIG              drive a real arm instead of the simulated cell: panda, so101, ur5_gripper or a
#                             file (docs/your-arm.md); the camera's driver is yours to start
#   --dry-run, --step         with --arm: plan and show only; ask before each motion (scripts/allow.sh)
#   --experience STORE        SQLite file or database URL: executed imitations improve the model
#   --params FILE             ROS parameter file; likeme_bringup/config/cell.yaml has all names
#   --domain N                ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 ended by a signal, 1 a node died or did not start, or the part runs on this ROS domain
# already, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
for word; do
  if [[ $word == --arm || $word == --arm=* ]]; then
    source "$here/extra.bash"
    install_extra scripts/real_arm.lock
    break
  fi
done
run_program likeme_bringup.start_cell "$@"
