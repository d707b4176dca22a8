#!/usr/bin/env bash
# Usage: scripts/view.sh BAG | FILE.rrd | --live [OPTION...]
#
# A viewer for everybody (Rerun): camera, states with their probabilities, the cell in 3-D with the arm,
# beliefs and decisions over time, and what happened in sentences. Try: view.sh bags/story_acts --web
# The first run installs rerun-sdk (about 170 MB) from scripts/view.lock.
#
#   BAG          a recording; states, beliefs and decisions that are not in it are computed
#   FILE.rrd     what --save has written
#   --live       the running cell, until Ctrl-C or the window is closed
#
#   --web        in a browser of this host instead of a window; --port N: another port than 9090.
#                From elsewhere --save it, and view the file there
#   --save FILE.rrd   write it instead of opening a window
#   --world W    world of the cell (default: the recorded one, or the shipped one that the cell names)
#   --seconds S  with --live: end after S seconds
#   --network    look for the cell on other machines of the subnet too
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Paths are relative to the folder you are in.
# Exit codes: 0 done, 1 it cannot be read or shown, 2 usage, 3 no cell is running, 78 the port of --web
# is not free, 130 ended by Ctrl-C while a bag was read.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
source "$here/extra.bash"
install_extra scripts/view.lock
run_program likeme_replay.view "$@"
