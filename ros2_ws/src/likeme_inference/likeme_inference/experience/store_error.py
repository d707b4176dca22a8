"""The error of an experience store, without the imports of a database."""


class StoreError(Exception):
    """The store cannot be used; the message states what was expected and received."""
