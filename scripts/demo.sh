#!/usr/bin/env bash
# Usage: scripts/demo.sh [OPTION...]
#
# The main job from nothing: sets everything up (the first time), starts the cell, plays the
# paper's story and tells each step with its numbers. Under 90 s on two cores after the set-up.
#
#   --seed N            draws the positions, the hand and the noise
#   --world W           a shipped world (chung2015, the paper's; three_bins; one_more_manner) or a
#                       world file; plays its story
#   --object NAME       one act with this object instead of the story
#   --show FROM TO      what the person shows: two regions of the world, e.g. right left
#   --by MANNER         how the person shows it: place, push or drop
#   --operator WHO      who answers the robot: auto (the simulated person) or me (this keyboard)
#   --model FILE        another transition model
#   --out DIR           folder for the picture and the log of the nodes (default: out/demo)
#
# Exit codes: 0 every act reached the goal that was shown, 1 one did not, 2 usage,
# 130 Ctrl-C or SIGTERM.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.demo:run "$@"
