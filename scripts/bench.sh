#!/usr/bin/env bash
# Usage: scripts/bench.sh [NAME] [--json] [ARGUMENT...]
#
# Runs benchmarks/NAME.py and prints what it measured beside the bars it is held against.
# Without a name: the list.
#
#   --json   one JSON document with the machine, the bars and the notes
#
# A benchmark that compares with other libraries (inference, segmentation) installs them the first time,
# from benchmarks/NAME_peers.lock; hold installs the operator's screen from scripts/operator.lock, arm what
# plans a real arm's motions from scripts/real_arm.lock.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
if [[ $# == 0 ]]; then
  cd "$here/../benchmarks"
  for file in *.py; do
    if [[ $file != report.py && $file != *_peers.py && $file != *_robots.py ]]; then
      printf '%-20s %s\n' "${file%.py}" "$(sed -n '1{s/^"""//;s/"""$//;p}' "$file")"
    fi
  done
  exit 0
fi
name=$1
shift
file=$here/../benchmarks/$name.py
if [[ $name == report || $name == *_peers || $name == *_robots || $name == */* || ! -f $file ]]; then
  echo "bench.sh: there is no benchmark '$name'; scripts/bench.sh lists them." >&2
  exit 2
fi
if [[ -f $here/../benchmarks/${name}_peers.py ]]; then
  source "$here/extra.bash"
  # Not among the others: what they bring with them is seen by pytest.
  install_extra "benchmarks/${name}_peers.lock" "peers/$name"
  export PYTHONPATH=$PYTHONPATH:$LIKEME_VENV/peers/$name
fi
case $name in
  hold) extra=operator ;;
  arm) extra=real_arm ;;
  *) extra= ;;
esac
if [[ -n $extra ]]; then
  source "$here/extra.bash"
  install_extra "scripts/$extra.lock"
fi
run_program "$file" "$@"
