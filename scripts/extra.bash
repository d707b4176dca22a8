# Sourced by scripts that need packages which nothing else needs.
# `install_extra LOCK [FOLDER]`: sets up, and installs them when the lock (a path in this repository) is
# new; into a folder of the environment that nothing else looks into, where one is named.

install_extra() {
  local here
  here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
  "$here/setup.sh"
  source "$here/env.sh"
  local lock=$LIKEME_ROOT/$1 state
  state=$LIKEME_VENV/likeme/$(basename "$1" .lock)
  if ! sha256sum --status --check "$state" 2>/dev/null; then
    "$LIKEME_VENV/uv/bin/uv" pip install -q --python "$LIKEME_VENV/bin/python" --no-deps \
      ${2:+--target "$LIKEME_VENV/$2"} --require-hashes -r "$lock" || { echo "$(basename "$0"): could not install $1." >&2; exit 1; }
    # A new requirements.lock takes away what it does not name.
    sha256sum "$lock" "$LIKEME_ROOT/requirements.lock" >"$state"
  fi
}
