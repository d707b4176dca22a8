#!/usr/bin/env bash
# Usage: scripts/calibrate.sh --print FOLDER
#        scripts/calibrate.sh --points FILE.csv [--world FILE]
#        scripts/calibrate.sh --live | BAG | FOLDER | COLOUR.png DEPTH.png... [OPTION...]
#
# Finds where a camera is: by a printed board that lies on the table, and by the depth of the table.
# Writes position, target, roll and intrinsics into a world file; docs/your-camera.md has the steps.
#
#   --print FOLDER   the board as PDF, true to scale, for A4 and for Letter
#   --points FILE    from at least 4 points that the arm touched and the camera saw: a CSV with the
#                    columns x,y,z (base_link) and camera_x,camera_y,camera_z (optical frame), m
#   --live           from the running camera (README: topics)
#   BAG              from a recording of any RGB-D camera
#   FOLDER           from pairs NAME_color.png, NAME_depth.png (16-bit mm) with intrinsics.json
#
#   --world FILE     world file of yours that gets the pose (default: only say it)
#   --x M, --y M     the board's middle in base_link (default: the middle of the world's table)
#   --yaw DEGREES    the angle of the board's x axis from that of base_link (default: 0)
#   --thickness MM   of what the sheet is glued to (default: 0)
#   --out FILE.png   the picture with the world's regions drawn in
#
# Exit codes: 0 done, 1 the board is not seen well enough (nothing is written), 2 usage.
# All options: calibrate.sh --options

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
[[ ${1:-} != --options ]] || set -- --help
run_program likeme_replay.camera_tools.calibrate "$@"
