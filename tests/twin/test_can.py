# SPDX-License-Identifier: MIT
"""The CAN controller, what its bus is told by, the bus that it shares with other twins, and the hub between them: without QEMU,
which vm.c plays, and without sockets."""
import ctypes

import pytest

from twin.bench import c

TX, RX, PROTECT = 0x20, 0x220, 1 << 23
NOISE = "< noise >"


def frame(id_=0, data=(), **rest):
    f = c.can_frame(id=id_, count=len(data), **rest)
    for n, byte in enumerate(data):
        f.data[n] = byte
    return f


# ---- texts ----

def said(speaker, text):
    heard = None
    for byte in text.encode():
        heard = c.can_hear(speaker, byte)
    return heard


def told(speaker, f, now_ns):
    text = ctypes.create_string_buffer(96)
    length = c.can_tell(speaker, f, now_ns, ctypes.cast(text, ctypes.c_char_p))
    return text.raw[:length].decode()


def sent(heard):
    """(identifier, data, extended, remote) or None."""
    f = heard.frame
    return (f.id, tuple(f.data[:f.count]), f.extended, f.remote) if heard.sends else None


@pytest.mark.parametrize("slcan, text, expected", [
    (True, "t1232AABB\r", (0x123, (0xAA, 0xBB), False, False)), (True, "T1ABCDEF01FF\r", (0x1ABCDEF0, (0xFF,), True, False)),
    (True, "r1234\r", (0x123, (0, 0, 0, 0), False, True)), (True, "R1ABCDEF00\r", (0x1ABCDEF0, (), True, True)),
    (True, "t1239\r", None), (True, "t1232AA\r", None), (True, "t8000\r", None), (True, "x1230\r", None),
    (False, "< send 201 2 0 f >", (0x201, (0, 15), False, False)), (False, "< send 080 0  >", (0x080, (), False, False)),
    (False, "< send 1ABCDEF0 1 7 >", (0x1ABCDEF0, (7,), True, False)),
    (False, "< send 201 9 0 >", None), (False, "< send 201 2 0 >", None), (False, "< send 20g 0 >", None)])
def test_a_frame_is_read(slcan, text, expected):
    speaker = c.can_speaker(slcan=slcan)
    c.can_greet(speaker)
    for word in (["S6\r", "O\r"] if slcan else ["< open can0 >", "< rawmode >"]):
        said(speaker, word)
    assert sent(said(speaker, text)) == expected


def test_speakers():
    slcan, daemon, f = c.can_speaker(slcan=True), c.can_speaker(), frame(0x181, (1, 0xAB))
    assert said(slcan, "t1232AABB\r").answer == b"\a", "a closed one refuses frames"
    assert said(slcan, "S6\rO\r").answer == b"\r" and slcan.attached
    said(slcan, "t" + 300 * "0" + "\r")
    assert sent(said(slcan, "t1231FF\r")) == (0x123, (0xFF,), False, False), "a line without end is forgotten"
    assert told(slcan, f, 0) == "t181201AB\r" and told(slcan, frame(0x181, (0, 0), remote=True), 0) == "r1812\r"
    assert c.can_greet(daemon) == b"< hi >" and not daemon.attached
    assert said(daemon, "< open can0 >< rawmode >").answer == b"< ok >" and daemon.attached
    assert told(daemon, f, 1_500_000) == "< frame 181 0.001500 01AB >"
    assert told(daemon, frame(0x1ABCDEF0, (2,), extended=True), 2 * 10**9) == "< frame 1ABCDEF0 2.000000 02 >"


def crc15(bits):
    """ISO 11898-1."""
    crc = 0
    for bit in bits:
        crc = (crc << 1 ^ (0x4599 if bit ^ crc >> 14 else 0)) & 0x7FFF
    return [crc >> n & 1 for n in range(14, -1, -1)]


def wire_bits(f):
    def word(value, width):
        return [value >> n & 1 for n in range(width - 1, -1, -1)]
    bits = [0] + (word(f.id >> 18, 11) + [1, 1] + word(f.id & 0x3FFFF, 18) + [f.remote, 0, 0] if f.extended else
                  word(f.id, 11) + [f.remote, 0, 0]) + word(f.count, 4)
    bits += [] if f.remote else [b for n in range(f.count) for b in word(f.data[n], 8)]
    bits = [int(b) for b in bits]
    bits += crc15(bits)
    stuffed, run, last = 0, 0, None
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed, last, run = stuffed + 1, 1 - bit, 1
    return len(bits) + stuffed + 3 + 7  # delimiters and acknowledge, end of frame


@pytest.mark.parametrize("f", [(0x080, ()), (0x705, (5,)), (0x7FF, ()), (0, (0,) * 8), (0x2AA, tuple(range(8))),
                               (0x1ABCDEF0, (255,) * 8, True), (0x123, (0, 0), False, True)])
def test_bits_and_rank(f):
    f = frame(*f[:2], **dict(zip(("extended", "remote"), f[2:])))
    with_intermission = c.can_frame_bits(f) - wire_bits(f)
    assert with_intermission in (0, 3)
    assert with_intermission == c.can_frame_bits(frame(0x080)) - wire_bits(frame(0x080))


def test_who_goes_first():
    order = [frame(0x080), frame(0x080, remote=True), frame(0x080 << 18, extended=True), frame(0x080 << 18 | 1, extended=True),
             frame(0x081), frame(0x705)]
    ranks = [c.can_frame_rank(f) for f in order]
    assert ranks == sorted(ranks) and len(set(ranks)) == len(ranks)


# ---- mailboxes ----

@pytest.fixture
def controller():
    can = c.can()
    c.can_power_on(can)
    for at in range(TX, 0x620, 4):  # RAM that holds anything
        c.can_write(can, at, (0x800081 if at % 32 == 0 else 0) if at >= RX else 0x800008 if at % 16 == 0 else 0)
    c.can_write(can, 0x230, ~4 & 0xFFFFFFFF)  # AMR of the first: 11 bits
    c.can_write(can, 0x238, 0xFFFFFFFF)  # whatever its data
    c.can_write(can, RX, 0x8000A8)
    c.can_write(can, 0x14, 1)
    return can


def test_receiving(controller):
    f = frame(0x123, range(1, 9))
    c.can_write(controller, 0x18, 0x2000)
    assert c.can_read(controller, 0x18) == 0, "CONFIG keeps still while it runs"
    c.can_received(controller, f)
    assert c.can_read(controller, 8) == 1 and c.can_read(controller, 0x228) == 0x01020304, "first byte on top"
    assert c.can_read(controller, 0x22C) == 0x05060708 and c.can_read(controller, 0x224) >> 21 == 0x123
    c.can_received(controller, f)
    assert c.can_read(controller, 0) == (1 << 12 | 1 << 10), "the next one is lost"
    c.can_write(controller, RX, 1)
    assert c.can_read(controller, 8) == 0
    f.extended = True
    c.can_received(controller, f)
    assert c.can_read(controller, 8) == 0, "29 bits do not pass the filter"


@pytest.mark.parametrize("change, taken", [
    ({}, True), ({"id": 0x122}, False), ({"id": 0x323}, False), ({"remote": True}, False),
    ({"id": 0x123 << 18, "extended": True}, False),
    ({"data": (0x12, 0x34)}, True), ({"data": (0x12, 0x35, 3)}, False), ({"data": (0x13, 0x34, 3)}, False),
    ({"data": (0x12,)}, False), ({"data": ()}, False)])
@pytest.mark.parametrize("whatever", [None, "id", "remote", "extended", "data"])
def test_what_a_mailbox_takes(controller, change, taken, whatever):
    """Its code has an identifier and the first two bytes; a bit of the mask says that it does not matter."""
    f = {"id": 0x123, "data": (0x12, 0x34, 3), "extended": False, "remote": False, **change}
    masks = {"id": 0x7FF << 21, "extended": 4, "remote": 2}
    for at, value in ((0x230, 1 | 0x3FFFF << 3 | masks.get(whatever, 0)), (0x234, 0x123 << 21),
                      (0x238, 0xFFFF if whatever == "data" or f["remote"] else 0), (0x23C, 0x1234)):
        c.can_write(controller, at, value)
    one = frame(f["id"], f["data"])
    one.extended, one.remote = f["extended"], f["remote"]
    c.can_received(controller, one)
    assert (c.can_read(controller, 8) == 1) == (taken or whatever == next(iter(reversed(change)), ""))


def test_sending_and_errors(controller):
    f = c.can_frame()
    c.can_write(controller, 0x24, 0x321 << 21)
    c.can_write(controller, TX, 8 << 16 | 1)
    assert c.can_offer(controller, f) == 0 and f.count == 0 and f.id == 0x321, "unprotected bits alone change"
    c.can_write(controller, 0x24, 0)
    assert c.can_offer(controller, f) == 0 and f.id == 0x321, "nothing changes under way"

    def fails(error, times):
        for _ in range(times):
            c.can_failed(controller, 0, error)
        return c.can_read(controller, 0x10)
    assert fails(c.CAN_BIT_ERROR, 15) >> 16 & 3 == 0 and not c.can_passive(controller)
    assert fails(c.CAN_BIT_ERROR, 1) >> 16 & 3 == 1 and c.can_passive(controller), "passive from 128 on"
    assert fails(c.CAN_ACK_ERROR, 1) & 0xFF == 128, "not acknowledged, it counts no further"
    assert fails(c.CAN_BIT_ERROR, 16) >> 17 & 1 and c.can_offer(controller, f) < 0 and not c.can_recovers(controller)


def test_errors_that_it_hears_make_it_passive(controller):
    """From 128 on; of those there is no more than 255, and a frame that comes well takes one away."""
    for n in range(1, 300):
        c.can_heard_error(controller, c.CAN_BIT_ERROR)
        assert c.can_passive(controller) == (n >= 128) and c.can_read(controller, 0x10) >> 8 & 0xFF == min(n, 255)
    for n in range(128):
        assert c.can_passive(controller)
        c.can_received(controller, frame(0x123, (n,)))
    assert not c.can_passive(controller)


# ---- on a bus with other twins, QEMU played by vm.c ----

BIT_NS, CONFIG_500 = 2000, 9 << 16 | 15 << 8 | 2 << 5  # ten clocks a quantum, twenty of these a bit


class Bus:
    def __init__(self):
        self.vm = c.vm_played
        ctypes.memset(ctypes.addressof(self.vm), 0, ctypes.sizeof(self.vm))
        c.sysreg_design(0x48, 0)
        c.sysreg_reset(c.RESET_POWER_ON)
        c.can_bus_map()
        c.can_bus_open(b"can", False, None)
        region = self.vm.mapped.contents
        hook = ctypes.CFUNCTYPE
        self._read = hook(ctypes.c_uint32, ctypes.c_void_p, ctypes.c_uint32)(region.read)
        self._write = hook(None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32)(region.write)
        self._hears = hook(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int)(self.vm.hears)
        self._room = hook(ctypes.c_int, ctypes.c_void_p)(self.vm.room)
        self._changes = hook(None, ctypes.c_void_p, ctypes.c_int)(self.vm.changes)
        for n in range(32):  # RAM that holds anything
            self.put(TX + 16 * n, 0x800008)
            self.put(RX + 32 * n, 0x800080)

    def put(self, offset, value):
        self._write(None, offset, value)

    def get(self, offset):
        return self._read(None, offset)

    def on(self):
        self.put(0x18, CONFIG_500)
        self.put(0x14, 1)
        return self

    def hears(self, text):
        self._hears(None, text.encode(), len(text))

    def told(self):
        text = ctypes.string_at(ctypes.addressof(self.vm.sent)).decode()
        self.vm.sent[0] = 0
        return text

    def sends(self, id_):
        self.put(0x24, id_ << 21)
        self.put(TX, PROTECT | 1)  # no data

    def wait(self, for_ns):
        c.vm_played_wait(for_ns)

    def waits(self):
        return self.get(0x0C) != 0


@pytest.fixture
def alone():
    b = Bus()
    yield b
    b.wait(10**9)  # the next one begins on a bus that is at rest


@pytest.fixture
def bus(alone):
    alone.on().hears("< hi >< others 1 0 >")
    alone.told()
    return alone


def frame_ns(id_):
    return c.can_frame_bits(frame(id_)) * BIT_NS


def test_who_acknowledges(alone):
    assert alone.told() == "< node 0 0 >", "it says that it is a twin"
    alone.on()
    assert alone.told() == "< node 2000 0 >", "and at what rate it is on the bus"
    alone.sends(0x705)
    alone.wait(1_000_000)
    assert alone.waits() and alone.get(0x10) & 0xFF, "alone it is not acknowledged"
    alone.hears("< hi >< others 1 0 >")
    alone.wait(1_000_000)
    assert not alone.waits() and alone.told().startswith("< wire t7050 ")


def test_frames_of_others_take_their_bits(bus):
    bus.hears("< wire t0800 0 >< wire t0800 0 >")
    bus.sends(0x705)
    bus.wait(frame_ns(0x080) + frame_ns(0x705))
    assert bus.waits(), "the lower goes first"
    bus.wait(frame_ns(0x080) - 1)
    assert bus.waits()
    bus.wait(1)
    assert not bus.waits()
    bus.told()
    bus.hears("< wire t7FF0 0 >")
    bus.wait(1000)
    bus.sends(0x080)
    bus.wait(frame_ns(0x7FF))
    assert bus.waits(), "one that is on its way is not broken off"
    bus.wait(1_000_000)
    assert not bus.waits() and "< wire t0800 " in bus.told()


def test_it_hears_no_more_than_it_has_room_for(bus):
    count = 0
    while bus._room(None) > 0 and count < 10_000:
        bus.hears("< wire t0800 0 >")
        count += 1
    assert 10 < count < 10_000
    bus.wait(10**9)
    assert bus._room(None) > 0
    bus.hears("< wire t0800 0 >")
    bus.sends(0x705)
    bus.wait(frame_ns(0x705))
    assert bus.waits(), "and takes what comes then"


def test_twins_of_other_rates(bus):
    bus.hears("< others 1 1 >")
    bus.sends(0x705)
    bus.wait(500_000)
    assert bus.waits() and bus.get(0x10) & 0xFF >= 8, "it destroys its frames"
    assert ctypes.string_at(ctypes.addressof(bus.vm.sent)).startswith(NOISE.encode()), "of which all hear"
    bus.wait(10_000_000)
    assert bus.get(0x10) >> 17 & 1, "until it is off"
    told_ = bus.told()
    assert "< node 2000 1 >" in told_ and "< node 0 0 >" in told_, "which it says, and before that that it is passive"
    c.can_bus_reset()
    bus.on().hears("< others 1 0 >" + NOISE)
    assert bus.get(0x10) >> 8 & 0xFF == 1, "noise is an error that it has heard"


def test_a_cut_cable_and_the_bus_s_end(bus):
    c.can_bus_cut(True)
    assert bus.told() == "< node 0 0 >"
    c.can_bus_cut(False)
    assert bus.told() == "< node 2000 0 >"
    bus._changes(None, 0)
    bus.sends(0x705)
    bus.wait(1_000_000)
    assert bus.waits(), "nobody acknowledges"


# ---- the hub ----

class Hub:
    def __init__(self):
        self.h, self.now_ms = c.can_hub(), 0

    def told(self, end):
        """What has been written to an end since the last look."""
        waiting = self.h.ends[end].waiting
        text = ctypes.string_at(ctypes.addressof(self.h.ends[end].out), waiting).decode()
        c.can_hub_written(self.h, end, waiting, self.now_ms)
        return text

    def says(self, end, text):
        c.can_hub_hear(self.h, end, text.encode(), len(text), self.now_ms)
        c.can_hub_settle(self.h, self.now_ms)

    def comes(self, first):
        end = c.can_hub_join(self.h, self.now_ms)
        self.says(end, first)
        return end

    def leaves(self, *ends):
        for end in ends:
            c.can_hub_leave(self.h, end)
        c.can_hub_settle(self.h, self.now_ms)

    def passes(self, duration_ms=501):
        self.now_ms += duration_ms
        c.can_hub_settle(self.h, self.now_ms)

    def program(self):
        end = self.comes("< open can0 >")
        self.says(end, "< rawmode >")
        self.passes()
        self.told(end)
        return end

    def twin(self, bit_ns):
        end = self.comes(f"< node {bit_ns} 0 >")
        self.told(end)
        return end


@pytest.fixture
def hub():
    return Hub()


def test_hub_acknowledges(hub):
    a = hub.comes("< node 0 0 >")
    assert hub.told(a) == "< hi >"
    b = hub.twin(0)
    hub.says(a, "< node 2000 0 >")
    assert (hub.told(a), hub.told(b)) == ("", "< others 1 0 >"), "a controller that is off acknowledges nothing"
    hub.says(b, "< node 2000 0 >")
    assert hub.told(a) == "< others 1 0 >"
    hub.leaves(b)
    assert hub.told(a) == "< others 0 0 >"
    p = hub.comes("< open can0 >")
    hub.says(p, "< rawmode >")
    assert hub.told(p) == "< hi >< ok >< ok >"
    hub.says(a, "< wire t1231AA 0 >")
    assert hub.told(p) == "" and c.can_hub_waits(hub.h), "nothing right behind the answer"
    hub.passes()
    assert not c.can_hub_waits(hub.h) and hub.told(a) == "< others 1 0 >", "then it acknowledges, by itself"
    hub.says(p, "< twins >")
    assert hub.told(p) == "< twins 1 >"
    hub.leaves(p)
    assert c.can_hub_twins(hub.h) == 1, "programs are no twins"


def test_hub_frames(hub):
    a, b, p, q = hub.twin(2000), hub.twin(2000), hub.program(), hub.program()
    ends = (a, b, p, q)

    def all_told():
        return tuple(hub.told(end) for end in ends)
    all_told()
    for who, text, expected in [
            (a, "< wire t181201AB 1500000 >",
             ("", "< wire t181201AB 1500000 >", "< frame 181 0.001500 01AB >", "< frame 181 0.001500 01AB >")),
            (p, "< send 080 0  >", ("< wire t0800 1500000 >", "< wire t0800 1500000 >", "", "< frame 080 0.001500  >")),
            (b, "< wire R1ABCDEF04 0 >", ("< wire R1ABCDEF04 0 >", "", "", "")),  # socketcand has no word for it
            (p, "< send 201 9 0 >", ("", "", "< error not a frame >", ""))]:
        hub.says(who, text)
        assert all_told() == expected, text


def test_hub_rates(hub):
    a, b = hub.twin(2000), hub.twin(4000)
    p = hub.program()
    assert hub.told(a) == "< others 0 1 >< others 1 1 >", "a twin of another rate destroys"
    hub.says(p, "< send 080 0  >")
    assert hub.told(a) == NOISE
    hub.told(b)
    hub.says(a, NOISE)
    assert hub.told(b) == NOISE, "a frame that it has destroyed"
    hub.says(b, "< node 4000 1 >")
    assert hub.told(a) == "< others 1 0 >", "not if it is error passive"
    hub.says(a, "< wire t1230 0 >")
    assert hub.told(b) == NOISE and hub.told(p).endswith("< frame 123 0.000000  >"), "then it hears noise"
    hub.says(b, "< node 2000 0 >")
    hub.told(b)
    hub.says(a, "< wire t1230 0 >")
    assert hub.told(b) == "< wire t1230 0 >"


def test_hub_is_needed(hub):
    assert not c.can_hub_is_needed(hub.h)
    a, late = hub.twin(2000), hub.comes("< no")
    hub.leaves(a)
    assert c.can_hub_is_needed(hub.h), "who has not said what he is may be a twin"
    hub.says(late, "de 2000 0 >")
    assert c.can_hub_is_needed(hub.h) and c.can_hub_twins(hub.h) == 1
    hub.leaves(late)
    p = hub.comes("")
    assert c.can_hub_is_needed(hub.h), "somebody new in its place, too"
    hub.says(p, "< twins >")
    assert not c.can_hub_is_needed(hub.h)
    hub.leaves(p)
    assert not c.can_hub_is_needed(hub.h)


def test_hub_waits_for_the_slow(hub):
    a, b, p = hub.twin(2000), hub.twin(2000), hub.program()

    def floods(count):
        for _ in range(count):
            hub.says(p, "< send 181 8 1 2 3 4 5 6 7 8 >")
        hub.told(b)
    floods(3000)
    assert not c.can_hub_may_speak(hub.h, p, hub.now_ms) and c.can_hub_may_speak(hub.h, b, hub.now_ms)
    c.can_hub_written(hub.h, a, 100, hub.now_ms + 900)
    assert not c.can_hub_may_speak(hub.h, p, hub.now_ms + 1500), "as long as it takes something"
    assert c.can_hub_may_speak(hub.h, p, hub.now_ms + 2000), "not for ever"
    floods(5000)
    hub.says(b, "< node 0 0 >")
    hub.leaves(p)
    text = hub.told(a)
    assert len(text) > 200_000, "frames that it does not take are lost to it, others are not"
    assert text.endswith("< others 0 0 >"), "who is there is not"


def test_hub_has_room_for_so_many(hub):
    assert [c.can_hub_join(hub.h, 0) for _ in range(65)] == [*range(64), -1]
