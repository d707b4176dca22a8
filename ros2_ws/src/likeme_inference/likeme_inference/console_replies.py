"""The words of the operator's console: answers a person may type, and what is shown."""

from __future__ import annotations

from likeme_inference.tabletop.values import Reply

#: What a person types -> what it means. Numbers are those of the menu.
WORDS = {
    'done': Reply.DONE_BY_HAND,
    'try': Reply.TRY_ANYWAY,
    'skip': Reply.SKIP,
}
MEANINGS = {
    Reply.DONE_BY_HAND: 'I did it by hand: look',
    Reply.TRY_ANYWAY: 'try your best action anyway',
    Reply.SKIP: 'leave it',
}
MENU = '\n'.join(
    f'  {number}  {word:5} {MEANINGS[reply]}'
    for number, (word, reply) in enumerate(WORDS.items(), start=1)
)


def read_reply(text: str) -> Reply:
    """Understand a word of the menu, its number, or its beginning.

    Raises:
        ValueError: with the words there are.
    """
    typed = text.strip().lower()
    for number, (word, reply) in enumerate(WORDS.items(), start=1):
        if typed == str(number) or (typed and word.startswith(typed)):
            return reply
    raise ValueError(f'Expected one of {", ".join(WORDS)}, got {text.strip()!r}.')
