"""How much a file may make us hold or allocate, whatever its length fields claim.

A recording of a camera needs a fraction of this: 1 MiB chunks, frames of 1 MB.
"""

from __future__ import annotations

# One chunk, decompressed, or one message, bytes. Checked before anything is allocated.
MAX_BLOCK = 256 * 2**20
# Decompressed chunks kept for messages that lie between one another, bytes.
MAX_CACHE = 64 * 2**20
# Decompressed chunks whose log times overlap; with more, messages are sorted on disk.
MAX_OPEN = 256 * 2**20
# Messages in one file whose index had to be made anew.
MAX_MESSAGES = 16_000_000
# Message definitions, metadata.yaml, and every other text in a bag, bytes.
MAX_TEXT = 16 * 2**20
# Messages in one chunk.
MAX_IN_CHUNK = 2_000_000
# Topics, chunks, and files of one bag.
MAX_TOPICS = 10_000
MAX_CHUNKS = 1_000_000
MAX_FILES = 10_000
# What a compressed file (.zstd) may unpack to on disk, bytes.
MAX_UNPACKED = 64 * 2**30
