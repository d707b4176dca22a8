#!/usr/bin/env bash
# Usage: scripts/gaze.sh [OPTION...]
#
# Gaze following over ROS: starts a gaze node, lets a simulated mentor turn its head to targets on
# the left and right, and prints which goal the robot infers and where it turns its own head.
#
#   --trials N         number of trials (default: 4)
#   --blindfold        the mentor wears an opaque blindfold, as in Fig 6 of the paper
#   --experience WHAT  blindfold the robot has worn itself: none, windowed or opaque
#                      (default: none; with --blindfold: none, then opaque)
#   --distance         the robot also observes the distance of the mentor's fixation
#   --seed N           seed of the robot's experience and of the mentor
#   --points N         head movements the robot learns from (default: 200; 15 in Fig 6)
#   --start            start a gaze node (the default)
#   --no-start         use the gaze node that runs on this ROS domain
#   --domain N         ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 every trial was answered, 1 a trial was not or there is no gaze node, 2 usage,
# 130 Ctrl-C.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_experiments.commands.gaze:run "$@"
