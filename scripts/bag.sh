#!/usr/bin/env bash
# Usage: scripts/bag.sh COMMAND BAG... [OPTION...]
#
# Works with recorded bags: rosbag2 folders (MCAP, sqlite3), loose files of them, ROS 1 .bag files.
#
#   info BAG                     what is in it
#   doctor BAG                   is it whole, and does it make sense: one line a check
#   cut BAG --out NEW            a part of it: --start S --end S (from its beginning), --topics NAME
#   merge BAG BAG... --out NEW   several in one
#   repair BAG [--out NEW]       what a crash or a full disk left, mended into a new folder
#   export BAG --format lerobot|csv|mp4 --out FOLDER
#
# No command changes the bag it reads; repair --in-place keeps it under another name.
# Exit codes: 0 done, 1 failed or messages are missing, 2 usage. All options: bag.sh COMMAND --help

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
exec "$here/run.sh" python -m likeme_bags.bag_console "$@"
