#!/usr/bin/env bash
# Usage: scripts/look.sh COLOUR.png DEPTH.png [OPTION...]
#
# What perception finds in one RGB-D picture, without ROS: any camera, any table. DEPTH.png holds
# 16-bit millimetres registered to colour. Paths are relative to the folder you are in.
#
#   --background-color FILE, --background-depth FILE   the empty table: then hands are found too
#   --intrinsics FILE   JSON with fx, fy, cx, cy (default: a Kinect's)
#   --out FILE          the picture with what was found drawn in
#   --json              all numbers
#   --world W           the world whose objects are known: a shipped one or a world file
#   --learn NAME        an entry for a world file, of the largest thing in view
#
# Exit codes: 0 done, 1 the files cannot be used, 2 usage. All options: look.sh --options

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
[[ ${1:-} != --options ]] || set -- --help
exec "$here/run.sh" python -m likeme_perception.look "$@"
