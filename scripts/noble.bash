# Sourced by setup.sh: the environment .venv-noble, in which tests run with the versions of Ubuntu
# 24.04. requirements-noble.txt stands for its packages, the ROS wheels, laid out in a prefix as
# /opt/ros/jazzy is, for its ROS 2. What rosdep takes from pip comes from requirements.lock.

NOBLE_REQUIREMENTS=requirements-noble.txt
# Without a key in rosdep: a distribution's machine has them only if somebody installs them by hand.
NOBLE_ABSENT='pyarrow|distributed|dask|pytest-cov|pytest-repeat|pytest-rerunfailures'

choose_noble_python() {
  PYTHON=${LIKEME_PYTHON:-managed}
  local candidate PATH=${PATH//"$LIKEME_VENV/bin:"/}
  if [[ $PYTHON != managed ]]; then
    runs "$PYTHON" 3.12 || fail "LIKEME_PYTHON=$PYTHON is not a Python 3.12 that starts."
    PYTHON=$(path_of "$PYTHON")
    return
  fi
  for candidate in python3.12 /usr/bin/python3.12 "$HOME"/.pyenv/versions/3.12.*/bin/python; do
    if runs "$candidate" 3.12; then
      PYTHON=$(path_of "$candidate")
      return
    fi
  done
}

install_noble_packages() {
  local pinned
  pinned=$(sed -n 's/^\([a-z0-9-]*\)==.*/\1/p' "$NOBLE_REQUIREMENTS" | paste -sd '|')
  lock_lines without "uv|ros-[a-z0-9-]+|pybullet|$NOBLE_ABSENT|$pinned" >"$STATE/lock.txt"
  lock_lines only 'ros-[a-z0-9-]+' >"$STATE/ros.txt"
  uv pip install --python "$VENV/bin/python" --no-deps -r "$NOBLE_REQUIREMENTS" &&
    uv pip install --python "$VENV/bin/python" --no-deps --require-hashes -r "$STATE/lock.txt" &&
    uv pip install --python "$VENV/bin/python" --prefix "$VENV/ros" --no-deps --require-hashes -r "$STATE/ros.txt" &&
    write_noble_prefix
}

# What /opt/ros/jazzy/setup.bash sets.
write_noble_prefix() {
  cat >"$VENV/ros/setup.bash" <<'END'
_prefix=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
export ROS_VERSION=2 ROS_PYTHON_VERSION=3 ROS_DISTRO=jazzy
export AMENT_PREFIX_PATH=$_prefix CMAKE_PREFIX_PATH=$_prefix PYTHONPATH=$_prefix/lib/python3.12/site-packages
export LD_LIBRARY_PATH=$_prefix/lib PATH=$_prefix/bin:$PATH
# Otherwise the wheels' bootstrapper starts every process a second time.
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
for _libs in "$_prefix"/lib/python3.12/site-packages/ros_*.libs; do
  [[ ! -d $_libs ]] || LD_LIBRARY_PATH+=:$_libs
done
unset _prefix _libs
END
}

# Its own cache: a pybullet that was compiled against NumPy 1 fails with the NumPy 2 of .venv.
build_noble_pybullet() { UV_CACHE_DIR=${XDG_CACHE_HOME:-$HOME/.cache}/likeme-noble build_pybullet; }
