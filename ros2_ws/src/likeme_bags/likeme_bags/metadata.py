"""metadata.yaml of a rosbag2 folder, versions 1 to 9, read with suspicion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from likeme_bags.errors import DamagedError
from likeme_bags.limits import MAX_FILES, MAX_TEXT, MAX_TOPICS

NAME = 'metadata.yaml'
# metadata.yaml has eight.
_MAX_DEPTH = 40


@dataclass(frozen=True)
class TopicClaim:
    """What metadata.yaml says of a topic."""

    name: str
    type: str
    serialization: str
    qos: Any
    type_hash: str
    count: int


@dataclass(frozen=True)
class Metadata:
    """What metadata.yaml says of a bag."""

    version: int
    files: tuple[str, ...]
    message_count: int
    topics: tuple[TopicClaim, ...]
    # 'message', 'file' or ''.
    compression: str = ''
    compression_format: str = ''
    custom: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ''


def read_metadata(folder: Path) -> Metadata:
    """Read `folder`/metadata.yaml.

    Raises:
        FileNotFoundError: there is none.
        DamagedError: it is not what rosbag2 writes.
    """
    path = folder / NAME
    try:
        with path.open('rb') as file:
            text = file.read(MAX_TEXT + 1)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise DamagedError(f'Cannot read {path}: {error.strerror}.') from None
    if len(text) > MAX_TEXT:
        raise DamagedError(f'Expected at most {MAX_TEXT} bytes in {NAME}, got more.')
    try:
        _check_depth(text)
        document = yaml.load(text, yaml.CSafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise DamagedError(
            f'Expected YAML in {NAME}: {" ".join(str(error).split())[:100]}.'
        ) from None
    try:
        return _parsed(document['rosbag2_bagfile_information'])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DamagedError(
            f'{NAME} lacks something or has it in another form: {error!r}.'
        ) from None


def _check_depth(text: bytes) -> None:
    """Refuse nesting that the parser would need minutes for."""
    depth = 0
    for event in yaml.parse(text, yaml.CSafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MAX_DEPTH:
            raise DamagedError(f'Expected at most {_MAX_DEPTH} levels in {NAME}, got more.')


def _text(value: object) -> str:
    """A plain value as text. Not of lists: aliases let a small file stand for a huge one."""
    if value is None:
        return ''
    if not isinstance(value, str | int | float):
        raise TypeError(f'expected text, got a {type(value).__name__}')
    return str(value)


def _parsed(info: Mapping[str, Any]) -> Metadata:
    version = int(info['version'])
    if not 1 <= version <= 9:
        raise DamagedError(f'Expected version 1 to 9 of {NAME}, got {version}.')
    mode = _text(info.get('compression_mode')).lower()
    return Metadata(
        version,
        # Up to version 3 with the folder's name before them; never outside the folder.
        tuple(PurePosixPath(_text(p)).name for p in info['relative_file_paths'][:MAX_FILES]),
        int(info['message_count']),
        tuple(_topic(each) for each in info['topics_with_message_count'][:MAX_TOPICS]),
        '' if mode == 'none' else mode,
        _text(info.get('compression_format')),
        {_text(k): _text(v) for k, v in (info.get('custom_data') or {}).items()},
        _text(info.get('ros_distro')),
    )


def _topic(each: Mapping[str, Any]) -> TopicClaim:
    topic = each['topic_metadata']
    return TopicClaim(
        _text(topic['name']),
        _text(topic['type']),
        _text(topic['serialization_format']),
        topic.get('offered_qos_profiles') or '',
        _text(topic.get('type_description_hash')),
        int(each['message_count']),
    )
