#!/usr/bin/env bash
# Usage: scripts/test.sh [--fast] [PYTEST ARGUMENT...]
#
# Sets up (the first time) and runs all tests: tests/ and every package's test/ folder.
#
#   --fast   leave out the tests marked slow
#
# Other arguments go to pytest, e.g. scripts/test.sh -k goal, scripts/test.sh tests/test_layering.py
# The exit code is pytest's: 0 all passed, 1 some failed, 5 none chosen.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
arguments=()
if [[ ${1:-} == --fast ]]; then
  arguments+=(-m 'not slow')
  shift
fi
cd "$here/.."
exec "$here/run.sh" python -m pytest "${arguments[@]}" "$@"
