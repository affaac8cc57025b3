# SPDX-License-Identifier: MIT
"""Objects by SDO of CANopen, with python-can's interfaces (socketcan, socketcand, slcan, pcan, ...)."""
import copy
import threading

from .drive import ANSWER_S
from .errors import Refused, Silent

FRAME_S = 5.0
AXES_FROM, AXIS = 0x2000, 0x800  # objects from there on are each axis', the second's so much further
NO_OBJECT = 0x06020000


class CanLine:
    """interface, channel and options are python-can's."""

    owner = 3  # its number in object `owner`

    def __init__(self, interface, channel, node, **options):
        import can
        import canopen

        self._errors, self._can_error = canopen, can.CanError
        self._network, self._offset, self._one_at_a_time = canopen.Network(), 0, threading.RLock()
        self._late = threading.Event()  # a request got no answer in time: the next may be met by that answer
        try:
            self._network.connect(interface=interface, channel=channel, **options)
        except (can.CanError, OSError, ValueError) as error:
            raise Silent(f"{interface} {channel} cannot be opened: {error}") from error
        self._sdo = self._network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary())).sdo

    def close(self):
        self._network.disconnect()

    def second(self):
        """The same line for axis 2."""
        other = copy.copy(self)
        other._offset, other.close = AXIS, lambda: None
        return other

    def _index(self, entry):
        return entry.index + (self._offset if entry.index >= AXES_FROM else 0)

    def read(self, entry):
        data = self._answered(entry, self._sdo.upload, self._index(entry), entry.subindex)
        return int.from_bytes(data, "little", signed=entry.signed)

    def write(self, entry, value):
        data = value.to_bytes(entry.bits // 8, "little", signed=entry.signed)
        self._answered(entry, self._sdo.download, self._index(entry), entry.subindex, data)

    def _answered(self, entry, ask, *arguments):
        try:
            with self._one_at_a_time:
                self._sdo.RESPONSE_TIMEOUT = ANSWER_S if entry.name == "store" else FRAME_S
                return self._asked(ask, *arguments)
        except self._errors.SdoAbortedError as error:
            if self._offset and error.code == NO_OBJECT:
                raise Refused("this drive has no axis 2") from error
            raise Refused(f"{entry.name}: {error}") from error
        except (self._errors.SdoCommunicationError, self._can_error, OSError) as error:
            raise Silent(f"{entry.name}: {error}") from error

    def _asked(self, ask, *arguments):
        try:
            return ask(*arguments)
        except self._errors.SdoCommunicationError:
            if not self._late.is_set():
                self._late.set()
                raise
            self._late.clear()  # that was the answer to the request before
            return ask(*arguments)
