#!/usr/bin/env bash
# Usage: scripts/check.sh [--fix | --types]
#
# Format, lint and types: ruff format, ruff check, mypy --strict.
#
#   --fix     let ruff write what it can
#   --types   mypy alone
#
# Exit codes: 0 clean, 1 something was found.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
"$here/setup.sh"
source "$here/env.sh"
cd "$LIKEME_ROOT"
result=0
if [[ ${1:-} == --fix ]]; then
  ruff format .
  ruff check --fix . || result=1
elif [[ $# == 0 ]]; then
  ruff format --check . || result=1
  ruff check . || result=1
elif [[ $1 != --types ]]; then
  echo "check.sh: unknown argument '$1'; see --help." >&2
  exit 2
fi
# The stubs of likeme_msgs are made at build.
MYPYPATH=$(python -c 'import likeme_msgs, pathlib; print(pathlib.Path(likeme_msgs.__file__).parents[1])')
export MYPYPATH
mapfile -t files < <(find ros2_ws/src/*/likeme_* benchmarks scripts tools -name '*.py' | sort)
mypy "${files[@]}" || result=1
exit $result
