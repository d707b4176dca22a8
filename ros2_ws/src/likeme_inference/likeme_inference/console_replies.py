"""Answers that an operator may type at the console, and the menu that lists them."""

from __future__ import annotations

from collections.abc import Sequence

from likeme_inference.tabletop.values import Reply

#: Typed word -> answer, in the order of the menu.
WORDS = {
    'done': Reply.DONE_BY_HAND,
    'try': Reply.TRY_ANYWAY,
    'skip': Reply.SKIP,
}


def menu(options: Sequence[int], name: str, goal: str, action: str) -> str:
    """The answers that can be given, a line each with what follows from it.

    name, goal, action: of the request.
    """
    follows = {
        Reply.DONE_BY_HAND: f'I did it by hand: the robot looks whether the {name} is {goal}',
        Reply.TRY_ANYWAY: f'try it anyway: the robot does {action} to the {name}',
        Reply.SKIP: 'skip it: nothing moves',
    }
    return '\n'.join(
        f'  {number}  {word:5} {follows[reply]}'
        for number, (word, reply) in enumerate(WORDS.items(), start=1)
        if reply in options
    )


def read_reply(text: str) -> Reply:
    """Read a word of the menu, its number, or an abbreviation.

    Raises:
        ValueError: any other text.
    """
    typed = text.strip().lower()
    for number, (word, reply) in enumerate(WORDS.items(), start=1):
        if typed == str(number) or (typed and word.startswith(typed)):
            return reply
    raise ValueError(f'Expected one of {", ".join(WORDS)}, got {text.strip()!r}.')
