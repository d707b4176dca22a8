#!/usr/bin/env bash
# Usage: scripts/bag.sh COMMAND BAG... [OPTION...]
#
# Works with recorded bags: rosbag2 folders (MCAP, sqlite3), loose files of them, ROS 1 .bag files.
#
#   info BAG                     topics, message counts, rates and times
#   doctor BAG                   checks of the files and their messages, one line each
#   cut BAG --out NEW            a time range or some topics: --start S --end S --topics NAME
#   merge BAG BAG... --out NEW   several bags as one
#   repair BAG [--out NEW]       all that can be read, in a new bag with index and metadata.yaml
#   export BAG --format lerobot|csv|mp4 --out FOLDER
#
# No command changes the bag it reads; repair --in-place renames it.
# Exit codes: 0 done, 1 failed or messages are missing, 2 usage. All options: bag.sh COMMAND --help

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_bags.bag_console "$@"
