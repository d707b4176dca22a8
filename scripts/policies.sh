#!/usr/bin/env bash
# Usage: scripts/policies.sh COMMAND [OPTION...]
#
# Safety and liveness policies of the cell, checked on its topics alone (docs/policies.md).
#
#   watch            beside a running cell, until Ctrl-C: violations are errors in the log and on
#                    /diagnostics. --domain N: its ROS domain (default: ROS_DOMAIN_ID or 0)
#   check BAG...     on recordings
#   list             all policies, as a Markdown table
#
# Exit codes: 0 done, 1 a policy is broken in a recording or it cannot be read, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_replay.policies.console "$@"
