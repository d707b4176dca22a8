"""Answers that an operator may type at the console, and the menu that lists them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from likeme_inference.tabletop.values import Reply

#: Typed word -> answer, in the order of the menu.
WORDS = {
    'done': Reply.DONE_BY_HAND,
    'try': Reply.TRY_ANYWAY,
    'skip': Reply.SKIP,
    'goal': Reply.NAME_GOAL,
}
WORD_OF = {reply: word for word, reply in WORDS.items()}


class TypedAnswer(NamedTuple):
    """What was typed; `goal`: name of a region, with NAME_GOAL alone."""

    reply: Reply
    goal: str = ''


def menu(options: Sequence[int], name: str, goal: str, action: str, regions: Sequence[str]) -> str:
    """The answers that can be given, a line each with what follows from it.

    name, goal, action: of the request. regions: their names.
    """
    named = ' or '.join(regions) or 'a region'
    follows = {
        Reply.DONE_BY_HAND: f'I did it by hand: the robot looks whether the {name} is {goal}',
        Reply.TRY_ANYWAY: f'try it anyway: the robot does {action} to the {name}',
        Reply.SKIP: 'skip it: nothing moves',
        Reply.NAME_GOAL: f'and {named}: that goal is meant, the robot decides anew',
    }
    return '\n'.join(
        f'  {number}  {word:5} {follows[reply]}'
        for number, (word, reply) in enumerate(WORDS.items(), start=1)
        if reply in options
    )


def read_answer(text: str) -> TypedAnswer:
    """Read a line: a word of the menu, with a region after `goal`.

    Raises:
        ValueError: any other text.
    """
    word, *rest = text.split() or ['']
    reply = WORDS[read_choice(word, tuple(WORDS))]
    if len(rest) != (reply is Reply.NAME_GOAL):
        wanted = 'a region after goal' if reply is Reply.NAME_GOAL else WORD_OF[reply]
        raise ValueError(f'Expected {wanted}, got {text.strip()!r}.')
    return TypedAnswer(reply, *rest)


def read_choice(text: str, words: Sequence[str]) -> str:
    """Read one of some words, its number from 1 on, or an abbreviation.

    Raises:
        ValueError: any other text.
    """
    typed = text.strip().lower()
    for number, word in enumerate(words, start=1):
        if typed == str(number) or (typed and word.startswith(typed)):
            return word
    raise ValueError(f'Expected one of {", ".join(words)}, got {text.strip()!r}.')
