#!/usr/bin/env bash
# Usage: scripts/teach.sh NAME --live | BAG | FOLDER | COLOUR.png DEPTH.png... --world FILE [OPTION...]
#        scripts/teach.sh NAME --check --world FILE
#
# Teaches an object: it lies alone on the table, and is turned between 5 views or more. The world
# file gets what it looks like, and a box or an ellipsoid of its size for the simulator.
#
#   --live         from the running camera: a view is taken whenever the object rests in another
#                  pose and no hand is in view
#   BAG            the same from a recording
#   FOLDER         views as pairs NAME_color.png, NAME_depth.png (16-bit mm), intrinsics.json beside
#                  them; or the files of pairs
#
#   --world FILE   world file of yours (world.sh new); an object of this name in it is replaced
#   --check        write nothing; say what the object could be mixed up with, with probabilities:
#                  without views by what the file says of it
#   --views N      with --live (default: 6)
#   --any-table    of pairs: find the camera's pose and the table in the image
#
# Exit codes: 0 done, 1 it cannot be learned (nothing is written), 2 usage.
# All options: teach.sh --options

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
[[ ${1:-} != --options ]] || set -- --help
run_program likeme_replay.camera_tools.teach "$@"
