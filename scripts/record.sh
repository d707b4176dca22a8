#!/usr/bin/env bash
# Usage: scripts/record.sh NAME [OPTION...]
#
# Records what a running cell says into a rosbag2 folder, until Ctrl-C: camera, table states,
# demonstrations, beliefs, decisions, outcomes, and what perception and inference took in. Killed at
# any moment, it leaves a bag that opens and misses at most its last second.
#
#   NAME            folder of the new bag; without a slash in it: out/bags/NAME
#   --all           every topic there is
#   --topics TOPIC  this topic instead of the usual ones; may be repeated
#   --storage S     mcap (default) or sqlite3
#   --compression C lz4 (default; sqlite3: zstd), zstd (a third smaller, read more slowly) or none
#   --duration S    end after so many seconds
#   --domain N      ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 done, 1 messages were lost or nothing was recorded, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_replay.record "$@"
