#!/usr/bin/env bash
# Usage: scripts/reproduce.sh NAME [--json] [--out DIR] [OPTION...]
#
# Computes a table or figure of the paper and prints it beside the paper's values.
# `scripts/reproduce.sh --list` lists the names; `all` computes all that take minutes at most.
#
#   --json        print one JSON document and nothing else
#   --out DIR     also draw DIR/NAME.png and DIR/NAME.svg; posterior: write its draws as DIR/posterior.npz
#   --arviz       posterior, with --out: also DIR/posterior.nc, for ArviZ (installed the first time from
#                 scripts/arviz.lock)
#   --seeds N     number of independent repetitions, for random computations
#   --model M     shipped, learned, or the path of a model file or experience store
#   --world W     a shipped world or a world file (default: chung2015)
#   --workers N   processes, for long computations
#
# Exit codes: 0 done, 1 failure, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
if [[ " $* " == *" --arviz "* ]]; then
  source "$here/extra.bash"
  install_extra scripts/arviz.lock
fi
run_program likeme_experiments.commands.reproduce:run "$@"
