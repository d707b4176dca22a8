"""Answers that an operator may type at the console, and the menu that lists them."""

from __future__ import annotations

from likeme_inference.tabletop.values import Reply

#: Typed word -> answer, in the order of the menu.
WORDS = {
    'done': Reply.DONE_BY_HAND,
    'try': Reply.TRY_ANYWAY,
    'skip': Reply.SKIP,
}
MEANINGS = {
    Reply.DONE_BY_HAND: 'I did it by hand',
    Reply.TRY_ANYWAY: 'try your best action anyway',
    Reply.SKIP: 'skip it',
}
MENU = '\n'.join(
    f'  {number}  {word:5} {MEANINGS[reply]}'
    for number, (word, reply) in enumerate(WORDS.items(), start=1)
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
