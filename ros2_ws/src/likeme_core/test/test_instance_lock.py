"""One instance of a node per ROS domain."""

from __future__ import annotations

import subprocess
import sys

import pytest

from likeme_core.instance_lock import AlreadyRunningError, claim, is_free

#: Beyond the domains that a cell can run on.
DOMAIN = 9_000


def test_a_second_claim_is_refused_and_holds_nothing() -> None:
    with claim(DOMAIN, ['arm']):
        second = claim(DOMAIN, ['camera', 'arm'])
        with pytest.raises(AlreadyRunningError, match=f'arm already runs on ROS domain {DOMAIN}'):
            second.__enter__()
        assert is_free(DOMAIN, ['camera'])
        assert not is_free(DOMAIN, ['arm'])
    assert is_free(DOMAIN, ['arm'])


def test_other_domains_and_parts_are_independent() -> None:
    with claim(DOMAIN, ['arm']), claim(DOMAIN + 1, ['arm']), claim(DOMAIN, ['camera']):
        assert not is_free(DOMAIN + 1, ['arm'])


def test_a_lock_is_released_when_its_process_is_killed() -> None:
    code = (
        'from likeme_core.instance_lock import claim\n'
        f'with claim({DOMAIN + 2}, ["arm"]):\n'
        '    print("held", flush=True)\n'
        '    input()\n'
    )
    command = [sys.executable, '-c', code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b'held\n'
        assert not is_free(DOMAIN + 2, ['arm'])
        holder.kill()
    assert is_free(DOMAIN + 2, ['arm'])
