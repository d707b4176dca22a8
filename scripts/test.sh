#!/usr/bin/env bash
# Usage: scripts/test.sh [--fast] [--coverage] [--noble] [PYTEST ARGUMENT...]
#
# Sets up (the first time) and runs all tests, two files at a time: tests/ and every package's test/
# folder.
#
#   --fast       leave out the tests marked slow
#   --coverage   print at the end which share of each file's lines ran, also in node processes;
#                one file at a time
#   --noble      run in .venv-noble, made the first time: Python 3.12 and the packages in the versions of
#                Ubuntu 24.04 (requirements-noble.txt); what needs pyarrow or distributed is skipped
#
# Other arguments go to pytest, e.g. scripts/test.sh -k goal, scripts/test.sh tests/test_layering.py, and
# -n 0 runs one file at a time (as --pdb needs).
# The exit code is pytest's: 0 all passed, 1 some failed, 5 none chosen.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
arguments=()
coverage=
while [[ ${1:-} =~ ^--(fast|coverage|noble)$ ]]; do
  case $1 in
    --fast) arguments+=(-m 'not slow') ;;
    --coverage) coverage=1 ;;
    --noble) export LIKEME_ENV=noble ;;
  esac
  shift
done
cd "$here/.."
[[ -n $coverage ]] || exec "$here/run.sh" python -m pytest -n 2 --dist loadfile "${arguments[@]}" "$@"
"$here/run.sh" coverage erase
result=0
"$here/run.sh" coverage run -m pytest "${arguments[@]}" "$@" || result=$?
"$here/run.sh" coverage combine -q
"$here/run.sh" coverage report
exit $result
