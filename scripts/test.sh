#!/usr/bin/env bash
# Usage: scripts/test.sh [--fast] [--coverage] [--extras] [--noble] [PYTEST ARGUMENT...]
#
# Sets up (the first time) and runs all tests, two files at a time: tests/ and every package's test/
# folder.
#
#   --fast       leave out the tests marked slow
#   --coverage   print at the end which share of each file's lines ran, also in node processes;
#                one file at a time
#   --extras     install first what only some scripts need (scripts/*.lock): nothing is skipped for it
#   --noble      run in .venv-noble, made the first time: Python 3.12 and the packages in the versions of
#                Ubuntu 24.04 (requirements-noble.txt); what needs pyarrow or distributed is skipped
#
# Other arguments go to pytest, e.g. scripts/test.sh -k goal, scripts/test.sh tests/test_layering.py, and
# -n 0 runs one file at a time (as --pdb needs).
# The exit code is pytest's: 0 all passed, 1 some failed, 5 none chosen; and 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
arguments=()
coverage=
extras=
while [[ ${1:-} =~ ^--(fast|coverage|extras|noble)$ ]]; do
  case $1 in
    --fast) arguments+=(-m 'not slow') ;;
    --coverage) coverage=1 ;;
    --extras) extras=1 ;;
    --noble) export LIKEME_ENV=noble ;;
  esac
  shift
done
cd "$here/.."
for word in "$@"; do
  # Two files at a time, pytest says of it that no tests ran.
  if [[ ${word%%::*} == *.py && ! -e ${word%%::*} ]]; then
    echo "test.sh: Expected a file of tests below $PWD, got ${word%%::*}, which does not exist." >&2
    exit 2
  fi
done
if [[ " $*" == *" -"* ]]; then
  "$here/setup.sh"
  # pytest would say it in four lines, with a name of its own. --markers reads all options and runs nothing.
  said=$("$here/run.sh" python -m pytest --markers "$@" 2>&1 >/dev/null) || true
  wrong=$(sed -n '/: error: /{s/^.*: error: //p;q}' <<<"$said")
  if [[ -n $wrong ]]; then
    unknown=${wrong#unrecognized arguments: }
    [[ $unknown == "$wrong" ]] || wrong="Expected options of pytest, got $unknown."
    echo "test.sh: $wrong" >&2
    exit 2
  fi
fi
if [[ -n $extras ]]; then
  source "$here/extra.bash"
  for lock in scripts/*.lock; do install_extra "$lock"; done
fi
[[ -n $coverage ]] || exec "$here/run.sh" python -m pytest -n 2 --dist loadfile "${arguments[@]}" "$@"
"$here/run.sh" coverage erase
result=0
"$here/run.sh" coverage run -m pytest "${arguments[@]}" "$@" || result=$?
"$here/run.sh" coverage combine -q
"$here/run.sh" coverage report
exit $result
