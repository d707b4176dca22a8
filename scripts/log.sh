#!/usr/bin/env bash
# Usage: scripts/log.sh show [--last N] [--kind KIND]... [--json] | why DECISION | verify [--head HASH]
#                       | export [FILE] [--store PLACE] [--domain N] [--namespace NS]
#
# The decision log of a cell: what was seen, believed, decided, asked, answered, done and held, and by
# whom. The inference node writes it before anything follows from it.
#
#   show                the newest entries: -n N or --last N of them (default: 20), only of some kinds
#   why DECISION        how a decision came about and ended; it is made again from its record
#   verify              finds any changed, removed, inserted or moved entry; prints the head's hash.
#                       Entries cut off at the end are found by a hash noted earlier: --head HASH
#   export [FILE]       all entries as JSON lines, or to FILE.csv
#   --store PLACE       SQLite file or database URL (default: decision_log.sqlite in the state folder
#                       of the cell; with --experience it is in the experience store)
#   --domain N          ROS domain (default: ROS_DOMAIN_ID or 0); --namespace NS: of the cell
#
# Exit codes: 0 done, 1 damaged, or no such log or decision, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_inference.log_commands "$@"
