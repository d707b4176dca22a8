"""Mend two faults in the CMake files of the ROS 2 wheels.

Twenty-odd files under share/*/cmake carry the include folders of the machine the wheels were made
on: they get this Python's. One reads a list of files as ASCII, which cuts paths that have other
letters: it gets the encoding. Run with the Python of the virtual environment; running it again
changes nothing.
"""

from __future__ import annotations

import os
import re
import sys
import sysconfig
from pathlib import Path

BUILDER = r'/opt/python/cp3\d+-cp3\d+'
NUMPY_HEADERS = re.compile(BUILDER + r'/lib/python3\.\d+/site-packages/numpy/_?core/include')
FILE_LIST = re.compile(r'file\(STRINGS "\$\{idl_output\}" idl_tuples\)')
PYTHON_HEADERS = re.compile(BUILDER + r'/include/python3\.\d+')


def patched(text: str, python_headers: str, numpy_headers: str) -> str:
    """The text with this Python's include folders, and with the file list read as UTF-8."""
    text = NUMPY_HEADERS.sub(lambda _: numpy_headers, text)
    text = PYTHON_HEADERS.sub(lambda _: python_headers, text)
    return FILE_LIST.sub(lambda _: 'file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)', text)


def main(prefix: Path) -> int:
    """Patch every CMake file under `prefix`/share; return how many changed."""
    import numpy

    changed = 0
    for path in prefix.glob('share/**/*.cmake'):
        before = path.read_text(encoding='utf-8')
        after = patched(before, sysconfig.get_path('include'), numpy.get_include())
        if after != before:
            # A new file, not a write into the old one: that one may be a hard link into the
            # installer's cache, which other environments share.
            fresh = path.with_suffix('.fresh')
            fresh.write_text(after, encoding='utf-8')
            os.replace(fresh, path)
            changed += 1
    return changed


if __name__ == '__main__':
    print(f'{main(Path(sys.argv[1]))} CMake files patched')
