"""What the `doctor` checks of this machine: without ROS, and without a running cell."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

#: Greatest domain whose ports are not among those that Linux gives to clients.
GREATEST_DOMAIN = 101
PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
#: Sysctl that bounds each buffer of the profile's transports.
LIMITS = {
    'receiveBufferSize': 'net.core.rmem_max',
    'sendBufferSize': 'net.core.wmem_max',
}
RANGES = ('LOCALHOST', 'SUBNET', 'OFF', 'SYSTEM_DEFAULT')
#: Packages whose versions say most about an environment.
VERSIONS = ('likeme_core', 'rclpy', 'numpy', 'opencv-python-headless', 'pybullet', 'rosbags')


class Finding(NamedTuple):
    """One line of the report; `cure`: what to do, empty where nothing is to be mended."""

    about: str
    sentence: str
    cure: str = ''

    @property
    def line(self) -> str:
        """As a person reads it."""
        state = 'mend' if self.cure else 'ok'
        return f'{state:5} {self.about:12} {self.sentence}' + (
            f' {self.cure}' if self.cure else ''
        )


def machine_findings(
    environment: Mapping[str, str], proc: Path = Path('/proc/sys'), shm: Path = Path('/dev/shm')
) -> Iterator[Finding]:
    """Environment, versions, domain, discovery range, DDS profile and its buffers.

    proc, shm: where the kernel's settings and the shared memory are.
    """
    yield _environment(environment)
    yield Finding('versions', ', '.join(f'{name} {_version(name)}' for name in VERSIONS) + '.')
    yield _domain(environment.get('ROS_DOMAIN_ID', '0'))
    yield _discovery(environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE', ''))
    profile = _profile(environment)
    if isinstance(profile, Finding):
        yield profile
        return
    yield Finding('dds profile', f'{environment[PROFILE]}.')
    yield from _buffers(profile, proc)
    yield _shared_memory(profile, shm)


def buffer_findings(
    environment: Mapping[str, str], proc: Path = Path('/proc/sys')
) -> Iterator[Finding]:
    """Whether the kernel grants the socket buffers that the DDS profile asks for.

    proc: where the kernel's settings are.
    """
    profile = _profile(environment)
    yield from [profile] if isinstance(profile, Finding) else _buffers(profile, proc)


def _profile(environment: Mapping[str, str]) -> ElementTree.Element | Finding:
    path = environment.get(PROFILE, '')
    try:
        return ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as error:
        return Finding(
            'dds profile', f'{path or "none"} cannot be read ({error}).',
            f'Unset {PROFILE}, and source scripts/env.sh.',
        )  # fmt: skip


def _environment(environment: Mapping[str, str]) -> Finding:
    ros = environment.get('ROS_DISTRO', 'no ROS')
    rmw = environment.get('RMW_IMPLEMENTATION', 'the default RMW')
    sentence = f'Python {sys.version.split()[0]} in {sys.prefix}, {ros}, {rmw}.'
    if ros != 'jazzy' or rmw != 'rmw_fastrtps_cpp':
        return Finding(
            'environment', sentence,
            'Expected jazzy and rmw_fastrtps_cpp: source scripts/env.sh.',
        )  # fmt: skip
    return Finding('environment', sentence)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return '(unknown)'


def _domain(text: str) -> Finding:
    if not text.isdecimal() or int(text) > GREATEST_DOMAIN:
        return Finding(
            'domain', f'ROS_DOMAIN_ID is {text!r}.', f'Set it to 0 ... {GREATEST_DOMAIN}.'
        )
    return Finding('domain', f'ROS_DOMAIN_ID is {text}.')


def _discovery(given: str) -> Finding:
    if given not in RANGES:
        return Finding(
            'discovery', f'ROS_AUTOMATIC_DISCOVERY_RANGE is {given!r}.',
            f'Set it to one of {", ".join(RANGES)}.',
        )  # fmt: skip
    reach = {'LOCALHOST': 'this host only', 'SUBNET': 'the subnet', 'OFF': 'no other node'}
    return Finding('discovery', f'{given}: {reach.get(given, "as the system is configured")}.')


def _texts(profile: ElementTree.Element, tag: str) -> list[str]:
    """Texts of all elements of a name, in whatever namespace."""
    return [(e.text or '').strip() for e in profile.iter() if e.tag.rpartition('}')[2] == tag]


def _buffers(profile: ElementTree.Element, proc: Path) -> Iterator[Finding]:
    for tag, limit in LIMITS.items():
        wanted = max(map(int, filter(str.isdecimal, _texts(profile, tag))), default=0)
        try:
            allowed = int((proc / limit.replace('.', '/')).read_text())
        except (OSError, ValueError):
            yield Finding('buffers', f'{limit} cannot be read here.')
            continue
        if allowed < wanted:
            yield Finding(
                'buffers', f'{limit} is {allowed}, the profile asks for {wanted}.',
                f'Type: sudo sysctl -w {limit}={wanted}',
            )  # fmt: skip
        else:
            asks = f'the profile asks for {wanted}' if wanted else 'the profile asks for no size'
            yield Finding('buffers', f'{limit} is {allowed}, {asks}.')


def _shared_memory(profile: ElementTree.Element, shm: Path) -> Finding:
    segment = max(map(int, filter(str.isdecimal, _texts(profile, 'segment_size'))), default=0)
    try:
        free = shutil.disk_usage(shm).free
    except OSError:
        return Finding('memory', f'{shm} is not there.', 'Mount a tmpfs there.')
    sentence = f'{free >> 20} MiB free in {shm}, {segment >> 20} MiB needed for each node.'
    if free < 8 * segment:
        return Finding('memory', sentence, f'Remove what is not needed from {shm}.')
    return Finding('memory', sentence)
