"""A cell on two hosts: frames lost and the story on a clean cable; false claims on a lossy one.

Simulator on one host, perception and inference on the other, started by start_cell.sh --network
in two network namespaces (virtual_hosts/hosts.py). Exit code 3: this machine allows none.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from likeme_core.progress_bar import counted
from report import Bar, option_parser, publish, whole_number
from virtual_hosts.hosts import Host, NamespaceError, two_hosts

ROOT = Path(__file__).resolve().parents[1]
#: Manners by their numbers in Demonstration.msg; regions of chung2015.
PLACE, PUSH = 0, 1
LEFT, RIGHT = 0, 1
#: A claim above it must be right.
CLAIM = 0.8


@contextmanager
def cell(host: Host, state: Path, *options: str) -> Iterator[None]:
    """Parts of a cell on one host."""
    process = subprocess.Popen(
        host.command(str(ROOT / 'scripts' / 'start_cell.sh'), '--network', *options),
        stdout=sys.stderr, env=_environment(state),
    )  # fmt: skip
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def acts(what: str, camera: Host, state: Path, n: int, *options: str) -> list[dict[str, Any]]:
    """Run the driver on the camera's host; its lines, one for each of n acts.

    Raises:
        subprocess.CalledProcessError: the driver failed.
    """
    command = camera.command(
        sys.executable, '-m', 'two_hosts_parts.driver', '--acts', str(n), *options
    )
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parent,
        env=_environment(state) | {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'},
    ) as driver:  # fmt: skip
        assert driver.stdout is not None
        try:
            done = [json.loads(line) for line in counted(driver.stdout, what, n)]
        except BaseException:
            driver.kill()
            raise
    if driver.returncode:
        raise subprocess.CalledProcessError(driver.returncode, command)
    return done


def _environment(state: Path) -> dict[str, str]:
    return os.environ | {'LIKEME_STATE': str(state), 'ROS_DOMAIN_ID': '0'}


def false_claims(act: dict[str, Any]) -> list[str]:
    """What the demonstrations of one act claim above CLAIM that is not so."""
    wrong = []
    for seen in act['demonstrations']:
        manner = PUSH if act['by'] == 'push' else PLACE
        claims = {
            'object': (1.0, seen['object'] == act['object']),
            'x_i': (max(seen['x_i']), seen['x_i'][RIGHT] == max(seen['x_i'])),
            'x_f': (max(seen['x_f']), seen['x_f'][LEFT] == max(seen['x_f'])),
            'manner': (seen['p'], seen['manner'] == manner),
        }
        wrong += [
            f'{act["object"]} {act["by"]}: {name} {p:.2f}, {seen}'
            for name, (p, right) in claims.items()
            if p > CLAIM and not right
        ]
    return wrong


def clean(folder: Path, n: int, transport: str) -> tuple[list[Bar], list[str]]:
    """The story on a clean cable."""
    thinking = ('--only', 'inference', '--mode', 'goal_based', '--threshold', '0')
    with (
        two_hosts() as (camera, thinker),
        simulator(camera, folder),
        cell(thinker, folder / 'thinker', *watching(folder, transport), *thinking),
    ):
        done = acts('stories', camera, folder / 'driver', n, '--story')
    frames, lost, seen, wrong = summary(done)
    ended = sum(bool(act['outcomes']) for act in done)
    bars = [
        Bar('clean: frames lost', lost, 0, 'frames', 'none lost', frames),
        Bar('clean: demonstrations reported', seen, n, '', 'all', n, False),
        Bar('clean: stories with an outcome', ended, n, '', 'all', n, False),
        Bar('clean: false claims above 0.8', len(wrong), 0, '', 'none', n),
    ]
    return bars, wrong


def lossy(folder: Path, n: int, share: float, transport: str) -> tuple[list[Bar], list[str]]:
    """Demonstrations while the network drops a share of the packets, both ways."""
    with (
        two_hosts() as hosts,
        simulator(hosts[0], folder),
        cell(hosts[1], folder / 'thinker', *watching(folder, transport)),
    ):
        for host in hosts:
            host.lose(share)
        done = acts(f'acts, {share:.4g} lost', hosts[0], folder / 'driver', n)
    frames, lost, seen, wrong = summary(done)
    name = f'{share:.4g} of packets dropped'
    bars = [
        Bar(f'{name}: frames lost', lost, None, 'frames', None, frames),
        Bar(f'{name}: demonstrations reported', seen, None, '', None, n),
        Bar(f'{name}: false claims above 0.8', len(wrong), 0, '', 'none', n),
    ]
    return bars, wrong


def watching(folder: Path, transport: str) -> tuple[str, ...]:
    """Options of start_cell.sh for perception; transport: its image_transport."""
    folder.mkdir(exist_ok=True)
    path = folder / 'transport.yaml'
    path.write_text(f'perception_node: {{ros__parameters: {{image_transport: {transport}}}}}\n')
    return '--only', 'perception', '--params', str(path)


def simulator(camera: Host, folder: Path) -> AbstractContextManager[None]:
    """The simulated camera, person and arm on one host."""
    return cell(camera, folder / 'camera', '--only', 'hold', '--only', 'arm', '--seed', '1')


def summary(done: list[dict[str, Any]]) -> tuple[int, int, int, list[str]]:
    """Frames published, frames without a table_state, demonstrations reported, false claims."""
    frames = sum(act['frames'] for act in done)
    lost = frames - sum(act['tables'] for act in done)
    seen = sum(len(act['demonstrations']) for act in done)
    return frames, lost, seen, [claim for act in done for claim in false_claims(act)]


def main() -> None:
    """Run and publish; exit code 1 when a bar is missed."""
    parser = option_parser('two_hosts')
    parser.add_argument('--n', type=whole_number, default=6, help='Stories on a clean cable.')
    parser.add_argument('--lossy', type=whole_number, default=50, help='Demonstrations per share.')
    parser.add_argument('--transport', choices=['raw', 'compressed'], default='raw')
    parser.add_argument('--share', type=float, nargs='*', default=[0.00005, 0.0003, 0.2])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            bars, wrong = clean(Path(folder), given.n, given.transport) if given.n else ([], [])
            for share in given.share if given.lossy else []:
                more, also_wrong = lossy(
                    Path(folder) / str(share), given.lossy, share, given.transport
                )
                bars, wrong = bars + more, wrong + also_wrong
        except NamespaceError as error:
            print(error, file=sys.stderr)
            sys.exit(3)
    sys.exit(0 if publish('two_hosts', bars, {'false claims': wrong}) else 1)


if __name__ == '__main__':
    main()
