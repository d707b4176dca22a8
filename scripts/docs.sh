#!/usr/bin/env bash
# Usage: scripts/docs.sh [--serve] [OPTION...]
#
# Builds the documentation as a site into out/site; open out/site/index.html. Broken links end it with
# exit code 1. Its first run installs what it needs (scripts/docs.lock).
#
#   --serve   serve it on http://127.0.0.1:8000 and build again what is edited, until Ctrl-C
#
# Other options are those of `mkdocs build` and `mkdocs serve`.
# Exit codes: 0 done, 1 broken or could not install, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
source "$here/extra.bash"
install_extra scripts/docs.lock
command=(build -q)
[[ ${1:-} != --serve ]] || { command=(serve); shift; }
cd "$here/.."
export NO_MKDOCS_2_WARNING=1
run_program "$here/../tools/mkdocs_command.py" "${command[@]}" "$@"
