# Sourced by every script here, or by hand: `source scripts/env.sh`. Sets the one environment all of
# LikeMe runs in: ROS 2 from the wheels in .venv or from /opt/ros/jazzy, then the built workspace.
# Already chosen values of ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and the thread counts stay.

LIKEME_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
if [[ ${LIKEME_ENV:-} == noble ]]; then
  # The versions of Ubuntu 24.04, see setup.sh; the ROS wheels play /opt/ros/jazzy.
  LIKEME_VENV=$LIKEME_ROOT/.venv-noble
  LIKEME_WS=$LIKEME_VENV/ws
  LIKEME_ROS_PREFIX=$LIKEME_VENV/ros
else
  LIKEME_VENV=$LIKEME_ROOT/.venv
  LIKEME_WS=$LIKEME_ROOT/ros2_ws
fi
# Another prefix can be named; one that does not exist means: take the wheels.
: "${LIKEME_ROS_PREFIX:=/opt/ros/jazzy}"
export LIKEME_ROOT LIKEME_ROS_PREFIX

# Prefixes of another workspace or ROS, and packages on PYTHONPATH, would shadow ours.
unset _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH PYTHONHOME PYTHONPYCACHEPREFIX AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH

if [[ -f $LIKEME_ROS_PREFIX/setup.bash ]]; then
  # ROS's own scripts read variables that are not set.
  case $- in *u*) _likeme_u=1 ;; *) _likeme_u= ;; esac
  set +u
  source "$LIKEME_ROS_PREFIX/setup.bash"
  [[ -z $_likeme_u ]] || set -u
  unset _likeme_u
  export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
else
  # The virtual environment is the ament prefix of the wheels.
  export AMENT_PREFIX_PATH=$LIKEME_VENV CMAKE_PREFIX_PATH=$LIKEME_VENV
  export LD_LIBRARY_PATH=$LIKEME_VENV/lib
  # Otherwise the wheels' bootstrapper finds these folders and starts every process a second time.
  for _likeme_libs in "$LIKEME_VENV"/lib/python3.*/site-packages/ros_*.libs; do
    if [[ -d $_likeme_libs ]]; then
      LD_LIBRARY_PATH+=:$_likeme_libs
      export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
    fi
  done
  unset _likeme_libs
  export ROS_VERSION=2 ROS_PYTHON_VERSION=3 ROS_DISTRO=jazzy
  # The only one among the wheels.
  export RMW_IMPLEMENTATION=rmw_fastrtps_cpp
fi
export VIRTUAL_ENV=$LIKEME_VENV
case :$PATH: in *:"$LIKEME_VENV/bin":*) ;; *) export PATH=$LIKEME_VENV/bin:$PATH ;; esac

# What install/local_setup.bash would set; colcon writes that file without quotes, so it
# fails in a folder whose path has a space.
_likeme_prepend() { [[ :${!1:-}: == *:"$2":* ]] || export "$1=$2${!1:+:${!1}}"; }
if [[ -z ${LIKEME_NO_WORKSPACE:-} ]]; then
  for _likeme_prefix in "$LIKEME_WS"/install/*/; do
    _likeme_prefix=${_likeme_prefix%/}
    _likeme_name=${_likeme_prefix##*/}
    [[ -d $_likeme_prefix/share/ament_index ]] || continue
    _likeme_prepend AMENT_PREFIX_PATH "$_likeme_prefix"
    [[ ! -d $_likeme_prefix/share/$_likeme_name/cmake ]] || _likeme_prepend CMAKE_PREFIX_PATH "$_likeme_prefix"
    [[ ! -d $_likeme_prefix/bin ]] || _likeme_prepend PATH "$_likeme_prefix/bin"
    for _likeme_path in "$_likeme_prefix"/lib/python3.*/site-packages; do
      [[ ! -d $_likeme_path ]] || _likeme_prepend PYTHONPATH "$_likeme_path"
    done
    for _likeme_path in "$_likeme_prefix"/lib/*.so; do
      [[ ! -f $_likeme_path ]] || _likeme_prepend LD_LIBRARY_PATH "$_likeme_prefix/lib"
    done
    # With --symlink-install a Python package is imported from its build folder.
    _likeme_path=$LIKEME_WS/build/$_likeme_name
    [[ ! -d $_likeme_path/$_likeme_name.egg-info ]] || _likeme_prepend PYTHONPATH "$_likeme_path"
  done
fi
unset -f _likeme_prepend
unset _likeme_prefix _likeme_name _likeme_path

# This host only, until somebody says otherwise (start_cell.sh --network).
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
export ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-0}
# Room in shared memory for camera frames; the default segment loses many of them.
export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$LIKEME_ROOT/ros2_ws/src/likeme_bringup/config/fastdds.xml}
# Matrices here are small: more threads per process only make three nodes wait for each other's
# cores (OpenBLAS threads spin while they wait).
export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1} OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
# Lines reach a pipe or a log when they are written.
export PYTHONUNBUFFERED=1
# Compiled modules are kept in the virtual environment, once that is complete, also where
# PYTHONDONTWRITEBYTECODE asks for
# clean folders: without them each process starts 1 to 2 s later.
if [[ -f $LIKEME_VENV/likeme/env ]]; then
  export PYTHONPYCACHEPREFIX=$LIKEME_VENV/pycache
  unset PYTHONDONTWRITEBYTECODE
fi
