"""Message types: from the definitions in a bag where it has them, else Jazzy's own."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from typing import Any, cast

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import (
    Stores,
    TypesysError,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.store import Typestore

from likeme_bags.errors import LIBRARY_ERRORS, BagError, DamagedError, UnsupportedError
from likeme_bags.limits import MAX_BLOCK
from likeme_bags.text_output import one_line
from likeme_bags.values import Topic

TYPE_NAME = re.compile(r'[A-Za-z]\w*/(msg|srv|action)/[A-Za-z]\w*', re.ASCII)
# Languages that definitions are written in; '' stands for ROS messages, too.
_LANGUAGES = ('ros2msg', 'ros2idl', 'omgidl', 'ros1msg', '')
_SEPARATOR = re.compile(r'^={3,} *(?:\n|\Z)', re.MULTILINE)
_HEADING = re.compile(r'\s*(MSG|IDL|SRV|ACTION): *(\S+) *(?:\n|\Z)')
# Literals (kept), comments, and preprocessor lines with those that a backslash continues them on.
_IDL_TOKENS = re.compile(
    r"""("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])')|/\*.*?\*/|//[^\n]*|^ *#(?:[^\n]*\\\n)*[^\n]*""",
    re.MULTILINE | re.DOTALL,
)
_CONSTANT = re.compile(r'^ *[\w/]+(?:<=\d+)? +\w+ *=.*$', re.MULTILINE)
_MAX_DEFINITION = 2**20


@lru_cache(maxsize=1)
def jazzy() -> Typestore:
    """The types that come with ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def full_name(type_name: str) -> str:
    """'sensor_msgs/msg/Image' from that or from the old 'sensor_msgs/Image'.

    Raises:
        DamagedError: it is neither.
    """
    if type_name.count('/') == 1:
        type_name = type_name.replace('/', '/msg/')
    if not TYPE_NAME.fullmatch(type_name):
        raise DamagedError(f"Expected a type as package/msg/Name, got '{type_name[:60]}'.")
    return type_name


def typestore_of(topic: Topic) -> Typestore:
    """A store that knows the topic's type.

    Raises:
        UnsupportedError: neither the bag nor Jazzy defines it, or the bag's definition cannot be
            used.
    """
    try:
        if topic.definition:
            return _defined(topic.type, topic.definition, topic.encoding)
        if topic.type not in jazzy().fielddefs:
            raise UnsupportedError(f'expected a definition of {topic.type}, got none.')
    except UnsupportedError as error:
        raise UnsupportedError(f'{topic.name}: {error}') from None
    return jazzy()


@lru_cache(maxsize=256)
def _defined(name: str, text: str, encoding: str) -> Typestore:
    if len(text) > _MAX_DEFINITION:
        raise UnsupportedError(f'expected a definition of {name}, got {len(text)} characters.')
    store = get_typestore(Stores.EMPTY)
    store.max_sequence_length = MAX_BLOCK
    try:
        store.register(parsed_definition(name, text, encoding))
        _add_missing(store, name)
        store.get_msgdef(name)
    except LIBRARY_ERRORS as error:
        raise UnsupportedError(
            f'expected a definition of {name} that can be used, got one that does not parse: '
            f'{one_line(error, 160)}.'
        ) from None
    return store


@lru_cache(maxsize=1024)
def _layout(name: str, text: str, encoding: str) -> str:
    try:
        return typestore_of(Topic('', name, 0, (), text, encoding)).hash_rihs01(name)
    except (*LIBRARY_ERRORS, BagError):
        return text


def layout(topic: Topic) -> str:
    """Equal for two definitions of a type with the same fields in the same order.

    The RIHS01 hash by the definition itself; the definition where it does not parse, maybe ''.
    """
    return _layout(topic.type, topic.definition, topic.encoding)


def parsed_definition(name: str, text: str, encoding: str) -> Typesdict:
    """The types of a definition: its own, and those that follow, each after a line of '='.

    Raises:
        one of LIBRARY_ERRORS: it cannot be parsed.
    """
    if encoding not in _LANGUAGES:
        raise TypesysError(f"expected it as {' or '.join(_LANGUAGES[:2])}, got '{encoding[:20]}'")
    types: Typesdict = {}
    for part in _SEPARATOR.split(_plain(text)):
        heading = _HEADING.match(part)
        language, own = heading.groups() if heading else ('', name)
        body = part[heading.end() :] if heading else part
        if language in ('SRV', 'ACTION'):
            raise TypesysError(f'the text of a {language.lower()} file defines no single message')
        if language == 'IDL' or (not language and encoding.endswith('idl')):
            if body := _IDL_TOKENS.sub(lambda token: token[1] or ' ', body).strip():
                types.update(get_types_from_idl(body))
        elif language or part.strip() or not types:
            types.update(_from_msg(body, own))
    return types


def _from_msg(text: str, name: str) -> Typesdict:
    try:
        types = get_types_from_msg(text, name)
    except TypesysError:
        # ROS 1 allowed names of constants that the parser does not.
        types = get_types_from_msg(_CONSTANT.sub('', text), name)
    # The parser puts /msg/ into names that have /srv/.
    return cast('Typesdict', _replaced(types, '/srv/msg/', '/srv/'))


def _replaced(value: Any, old: str, new: str) -> Any:
    if isinstance(value, str):
        return value.replace(old, new)
    if isinstance(value, dict):
        return {key.replace(old, new): _replaced(each, old, new) for key, each in value.items()}
    if isinstance(value, list) or type(value) is tuple:
        return type(value)(_replaced(each, old, new) for each in value)
    return value


def _plain(text: str) -> str:
    """Without byte order mark, and with line feeds and spaces as the only white space."""
    text = text.removeprefix('\ufeff').replace('\r\n', '\n').replace('\r', '\n')
    return re.sub(r'[^\S\n]', ' ', text)


def _add_missing(store: Typestore, name: str) -> None:
    """Add Jazzy's types that the definition refers to but does not contain."""
    known = jazzy()
    wanted, seen = [name], set[str]()
    while wanted:
        each = wanted.pop()
        if each not in store.fielddefs and each in known.fielddefs:
            store.fielddefs[each], store.types[each] = known.fielddefs[each], known.types[each]
        if each not in store.fielddefs:
            raise TypesysError(f'{each.removeprefix(_package(name))} is not defined')
        fields = [_element(field) for _, field in store.fielddefs[each][1]]
        seen.add(each)
        wanted += [type_name for type_name in fields if '/' in type_name and type_name not in seen]
        if 'wstring' in fields or 'wchar' in fields:
            raise TypesysError('wstring and wchar are not supported')


def _package(name: str) -> str:
    """'package/msg/' of a full name: what the parser puts before a base type it does not know."""
    return name[: name.rindex('/') + 1]


def _element(field: Any) -> str:
    """The type of a field, or of the elements of an array, by its name."""
    kind, detail = field
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        kind, detail = detail[0]
    return str(detail if kind == Nodetype.NAME else detail[0])


def jazzy_definition(name: str) -> tuple[str, str]:
    """Definition text and hash of a type of Jazzy; ('', '') when it is not one."""
    store = jazzy()
    if name not in store.fielddefs:
        return '', ''
    return store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name)


def decode(topic: Topic, data: bytes) -> object:
    """A message as an object with the fields of its type.

    Raises:
        UnsupportedError: the topic's definition cannot be used.
        DamagedError: the bytes are not such a message.
    """
    store = typestore_of(topic)
    try:
        return store.deserialize_cdr(data, topic.type)
    except (*LIBRARY_ERRORS, MemoryError) as error:
        if topic.definition and topic.type in jazzy().fielddefs:
            # Some tools embed definitions that are cut short.
            return decode(replace(topic, definition=''), data)
        raise DamagedError(
            f'{topic.name}: expected a {topic.type}, got other bytes: {one_line(error, 160)}'
        ) from None
