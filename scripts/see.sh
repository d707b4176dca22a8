#!/usr/bin/env bash
# Usage: scripts/see.sh BAG | --live | FOLDER | COLOUR.png DEPTH.png... [OPTION...]
#
# Draws what perception sees: outlines, major axes, identities and states with their probabilities,
# hands and arms, what is in no catalogue, and why a state is UNKNOWN. Try: see.sh bags/story_acts
#
#   BAG             a recording of any RGB-D camera: an MP4; --at S: one picture, S s after the first
#   --live          what the running perception_node draws on the topic table_overlay
#   FOLDER          pairs NAME_color.png, NAME_depth.png (16-bit mm, registered to colour), and if
#                   it is there intrinsics.json with fx, fy, cx, cy; or the files of pairs
#
#   --out FILE      PNG or MP4 (default: in out/see); for several pairs a folder
#   --world W       objects, camera pose and regions of a shipped world or a world file
#   --any-table     find the camera's pose and the table in the image (pairs without --world: so)
#   --save FOLDER   of a BAG: write the last frame as a pair of images
#   --background-color FILE, --background-depth FILE   of pairs: the empty table, to find hands
#   --json          all numbers
#
# Needs no ROS but for --live. Paths are relative to the folder you are in.
# Exit codes: 0 done, 1 it cannot be read or nothing came, 2 usage. All options: see.sh --options

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
[[ ${1:-} != --options ]] || set -- --help
run_program likeme_replay.camera_tools.see "$@"
