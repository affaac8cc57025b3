# SPDX-License-Identifier: MIT
"""The electronic data sheet that the drive serves at 0x1021: the text of `make eds`, whatever a client did before."""
import ctypes
import struct

import pytest

from rigs.can_node import NODE, RESET_COMMUNICATION, SDO_IN, Abort, Node
from eds import eds
from eds_packed import packed

BEGIN = struct.pack("<BHBI", 0x40, 0x1021, 0, 0)
SEGMENTS = [bytes([0x60]) + bytes(7), bytes([0x70]) + bytes(7)]
LIMITS, RAM = {1: 7400, 2: 12000}, 1100


@pytest.fixture
def node(c):
    return Node(c)


@pytest.fixture
def pair(two_buses):
    return Node(two_buses, count=2)


@pytest.fixture
def begun(node):
    """150 segments have been read: more than the window holds."""
    node.request(BEGIN)
    for number in range(150):
        node.request(SEGMENTS[number % 2])
    return node


def test_it_is_the_text_of_make_eds_to_the_byte(node):
    assert node.read(0x1021) == eds(1).encode("ascii")


def test_with_two_axes_it_has_both(pair):
    assert pair.read(0x1021) == eds(2).encode("ascii")


def test_its_format_is_text_that_is_not_packed(node):
    assert node.read(0x1022) == b"\0\0"


def test_it_says_of_itself_what_it_serves(node):
    sheet = node.read(0x1021).decode()
    assert "[1021]\nParameterName=Store EDS\nObjectType=0x7\nDataType=0x000F\nAccessType=ro\nPDOMapping=0\n" in sheet
    assert "[1022]\nParameterName=Store format\nObjectType=0x7\nDataType=0x0006\nAccessType=const\nDefaultValue=0\n" in sheet


@pytest.mark.parametrize("index", (0x1021, 0x1022))
def test_nobody_writes_it(node, index):
    with pytest.raises(Abort, match=f"^{0x06010002}$"):
        node.write(index, 0, 1, 4)
    with pytest.raises(Abort, match=f"^{0x06090011}$"):
        node.read(index, 1)


def test_begun_again_it_comes_from_its_beginning(begun):
    assert begun.read(0x1021) == eds(1).encode()


@pytest.mark.parametrize("count", range(1, 40))
def test_wherever_it_was_left(node, count):
    node.request(BEGIN)
    for number in range(count):
        node.request(SEGMENTS[number % 2])
    node.request(BEGIN)
    assert b"".join(node.request(SEGMENTS[number % 2])[1:] for number in range(50)) == eds(1)[:350].encode()


def test_behind_a_name_read_in_between_too(begun):
    assert begun.read(0x1008) == b"mssfoc" and begun.read(0x1021) == eds(1).encode()


def test_a_value_read_in_between_ends_it(begun):
    assert begun.value(0x1000) == 0x00020192
    with pytest.raises(Abort, match=f"^{0x05040001}$"):
        begun.request(SEGMENTS[0])
    assert begun.read(0x1021) == eds(1).encode()


def test_an_abort_of_the_client_ends_it(begun):
    assert begun.say((SDO_IN, struct.pack("<BHBI", 0x80, 0x1021, 0, 0x08000000))) == []
    with pytest.raises(Abort, match=f"^{0x05040001}$"):
        begun.request(SEGMENTS[0])
    assert begun.read(0x1021) == eds(1).encode()


def test_a_segment_asked_for_twice_ends_it(begun):
    with pytest.raises(Abort, match=f"^{0x05030000}$"):
        begun.request(SEGMENTS[1])
    with pytest.raises(Abort, match=f"^{0x05040001}$"):
        begun.request(SEGMENTS[0])


def test_a_reset_ends_it(begun):
    begun.nmt(RESET_COMMUNICATION, NODE)
    with pytest.raises(Abort, match=f"^{0x05040001}$"):
        begun.request(SEGMENTS[0])
    assert begun.read(0x1021) == eds(1).encode()


def test_it_takes_little_room(c, two_buses):
    for axes, library in ((1, c), (2, two_buses)):
        assert len(packed(eds(axes))[0]) < LIMITS[axes] and ctypes.sizeof(library.structs["data_sheet"]) <= RAM
