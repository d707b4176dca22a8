"""Network interfaces of this computer. Linux only."""

from __future__ import annotations

import fcntl
import socket
import struct
from contextlib import suppress

# Requests of netdevice(7), and the flag of an interface whose cable is plugged in (net/if.h).
_GET_FLAGS, _GET_ADDRESS = 0x8913, 0x8915
_RUNNING = 0x40


def running_networks() -> frozenset[tuple[str, str]]:
    """Name and IPv4 address of each interface that can send."""
    found = set()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        for _, name in socket.if_nameindex():
            request = struct.pack('16s24x', name.encode())
            # Without an address, or gone meanwhile.
            with suppress(OSError):
                flags = fcntl.ioctl(asked, _GET_FLAGS, request)
                address = fcntl.ioctl(asked, _GET_ADDRESS, request)
                if struct.unpack_from('H', flags, 16)[0] & _RUNNING:
                    found.add((name, socket.inet_ntoa(address[20:24])))
    return frozenset(found)
