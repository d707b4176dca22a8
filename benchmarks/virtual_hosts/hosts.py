"""Hosts on one machine: network and mount namespaces, connected by virtual cables.

Each host has network interfaces and a /dev/shm of its own, so that its processes reach those of
the others by UDP alone. Needs root, util-linux and iproute2.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, NamedTuple

SUBNET = '10.213.7'
#: Of a namespace: waits for its end at stdin.
HOLD = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo ready && exec cat'

UNSHARE = ('unshare', '--net', '--mount')
#: Environment variable of a program that runs in namespaces of its own.
OWN_NETWORK = 'LIKEME_OWN_NETWORK'

#: Codes of classic BPF (linux/bpf_common.h), and the address of a random word (linux/filter.h:
#: SKF_AD_OFF + SKF_AD_RANDOM).
LOAD_WORD, JUMP_IF_AT_LEAST, RETURN = 0x20, 0x35, 0x06
RANDOM = 2**32 - 0x1000 + 56


class NamespaceError(Exception):
    """Network namespaces are not allowed here; says why."""


class Host(NamedTuple):
    """One host: a process that keeps its namespaces, and its port at a switch, if it has one."""

    pid: int
    port: str = ''

    def command(self, *words: str) -> list[str]:
        """The command line that runs words on this host."""
        return ['nsenter', '--target', str(self.pid), '--net', '--mount', '--wd=.', *words]

    def run(self, *words: str) -> None:
        """Run a command to its end.

        Raises:
            NamespaceError: it failed; with what it said.
        """
        _run(self.command(*words))

    def connect(self, connected: bool) -> None:
        """Plug the cable to the switch in, or out."""
        _run(['ip', 'link', 'set', self.port, 'up' if connected else 'down'])

    def lose(self, share: float) -> None:
        """Drop a random share of the packets that arrive at this host, each IP fragment by itself.

        A packet filter of tc, since few kernels have netem: load a random word, accept (0) the
        packet if it is at least share of 2**32, drop it (2) if not.
        """
        least = min(round(share * 2**32), 2**32 - 1)
        program = (f'4,{LOAD_WORD} 0 0 {RANDOM},{JUMP_IF_AT_LEAST} 1 0 {least},'
                   f'{RETURN} 0 0 2,{RETURN} 0 0 0')  # fmt: skip
        _run(self.command('tc', 'qdisc', 'del', 'dev', 'cable', 'clsact'), must_work=False)
        self.run('tc', 'qdisc', 'add', 'dev', 'cable', 'clsact')
        self.run('tc', 'filter', 'add', 'dev', 'cable', 'ingress', 'protocol', 'all',
                 'bpf', 'direct-action', 'bytecode', program)  # fmt: skip


@contextmanager
def two_hosts() -> Iterator[tuple[Host, Host]]:
    """Two connected hosts; gone with the context.

    Raises:
        NamespaceError: the machine does not allow them.
    """
    _check_allowed()
    with ExitStack() as stack:
        hosts = Host(_namespace(stack)), Host(_namespace(stack))
        _run(['ip', 'link', 'add', 'cable', 'netns', str(hosts[0].pid), 'type', 'veth',
              'peer', 'name', 'cable', 'netns', str(hosts[1].pid)])  # fmt: skip
        for number, host in enumerate(hosts, 1):
            _configure('cable', number, host.command())
        yield hosts


@contextmanager
def hosts_at_switch(count: int) -> Iterator[tuple[Host, ...]]:
    """Hosts at a switch, at which this process is, too; gone with the context.

    The process must have a network namespace of its own (see `own_network`).

    Raises:
        NamespaceError: the machine does not allow them.
    """
    with ExitStack() as stack:
        _run(['ip', 'link', 'set', 'lo', 'up'])
        # Without a router no host would be asked which groups it wants.
        _run(['ip', 'link', 'add', 'switch', 'type', 'bridge', 'mcast_snooping', '0'])
        stack.callback(_run, ['ip', 'link', 'delete', 'switch'], must_work=False)
        _configure('switch', 254, [])
        hosts = []
        for number in range(1, count + 1):
            host = Host(_namespace(stack), f'port{number}')
            _run(['ip', 'link', 'add', host.port, 'type', 'veth',
                  'peer', 'name', 'cable', 'netns', str(host.pid)])  # fmt: skip
            _run(['ip', 'link', 'set', host.port, 'master', 'switch', 'up'])
            _configure('cable', number, host.command())
            hosts.append(host)
        yield tuple(hosts)


def _check_allowed() -> None:
    """Check that this machine has what namespaces need.

    Raises:
        NamespaceError: it has not.
    """
    missing = [tool for tool in ('unshare', 'nsenter', 'ip', 'tc') if not shutil.which(tool)]
    if missing or os.geteuid() != 0:
        wanted = f'the commands {", ".join(missing)}' if missing else 'root'
        raise NamespaceError(f'Expected {wanted} for network namespaces, got none.')


def own_network() -> bool:
    """Have this program run in namespaces of its own: start it again there, once.

    Returns:
        Whether it runs there; not where the machine does not allow it.
    """
    with suppress(NamespaceError):
        if OWN_NETWORK not in os.environ:
            _check_allowed()
            _run([*UNSHARE, 'true'])
            os.environ[OWN_NETWORK] = '1'
            os.execvp(UNSHARE[0], [*UNSHARE, *sys.orig_argv])
    return OWN_NETWORK in os.environ


def _configure(link: str, number: int, on: list[str]) -> None:
    """Give a link an address and have it used for multicast; on: `Host.command()` of its host."""
    _run([*on, 'ip', 'address', 'add', f'{SUBNET}.{number}/24', 'dev', link])
    _run([*on, 'ip', 'link', 'set', link, 'up'])
    _run([*on, 'ip', 'route', 'add', '224.0.0.0/4', 'dev', link])


def _namespace(stack: ExitStack) -> int:
    process: subprocess.Popen[Any] = subprocess.Popen(
        [*UNSHARE, 'sh', '-c', HOLD],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    stack.callback(process.communicate)
    assert process.stdout is not None
    if process.stdout.readline() != b'ready\n':
        _, said = process.communicate()
        raise NamespaceError(f'Expected a network namespace, got: {said.decode().strip()}')
    return process.pid


def _run(words: list[str], must_work: bool = True) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode and must_work:
        raise NamespaceError(f'Expected {" ".join(words)} to work, got: {done.stderr.strip()}')
