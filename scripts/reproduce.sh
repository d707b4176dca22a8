#!/usr/bin/env bash
# Usage: scripts/reproduce.sh NAME [--json] [--out DIR] [OPTION...]
#
# Computes a table or figure of the paper anew and prints it, the paper's values beside ours.
# `scripts/reproduce.sh --list` names them; `all` runs them all.
#
#   --json        one JSON document on stdout and nothing else
#   --out DIR     draw it too: DIR/NAME.png and DIR/NAME.svg
#   --seeds N     how many independent repetitions, where chance plays a part
#   --model M     shipped, learned, or the path of a model file, where a model is used
#   --workers N   processes, where there is much to do
#
# Exit codes: 0 done, 1 it failed, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
exec "$here/run.sh" python -m likeme_experiments.reproduce "$@"
