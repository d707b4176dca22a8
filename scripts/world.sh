#!/usr/bin/env bash
# Usage: scripts/world.sh COMMAND [ARGUMENT...]
#
# World files: which regions, objects and actions there are, and the geometry of the cell. Everything
# takes one by --world; docs/your-world.md goes from an empty file to a running story.
#
#   list                      the shipped worlds
#   check NAME|FILE           what is in it, or every problem with its line, expected and got
#   draw NAME|FILE            a picture of the table from above: --out FILE.png
#   new FILE                  starts a file: a copy of three_bins to change
#   looks NAME|FILE [OBJECT]  what the simulated camera sees of objects, for the file's `looks`
#
# Exit codes: 0 done, 1 the file cannot be used, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_bringup.world_commands "$@"
