/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The CAN controller and what its bus is told by, without QEMU. */
#include <string.h>

#include "can.h"
#include "check.h"
#include "socketcand.h"

static struct can c;

static struct can_heard said(struct can_speaker *s, const char *text)
{
    struct can_heard heard = {0};
    for (; *text; text++) {
        heard = can_hear(s, *text);
    }
    return heard;
}

static void speakers(void)
{
    struct can_speaker slcan = {.slcan = true}, daemon = {0};
    struct can_frame f = {.id = 0x181, .count = 2, .data = {1, 0xAB}};
    char text[CAN_TEXT_BYTES];
    check_true("a closed slcan refuses frames", strcmp(said(&slcan, "t1232AABB\r").answer, "\a") == 0);
    check_true("it opens", strcmp(said(&slcan, "S6\rO\r").answer, "\r") == 0 && slcan.attached);
    struct can_heard heard = said(&slcan, "t1232AABB\r");
    check_true("and sends",
               heard.sends && heard.frame.id == 0x123 && heard.frame.count == 2 && heard.frame.data[1] == 0xBB);
    check_true("29 bits", said(&slcan, "T1ABCDEF01FF\r").frame.extended);
    check_true("not what has nine bytes", !said(&slcan, "t1239\r").sends);
    check_true("nor a half one", !said(&slcan, "t1232AA\r").sends);
    text[can_tell(&slcan, &f, 0, text)] = '\0';
    check_true("it is told", strcmp(text, "t181201AB\r") == 0);
    check_true("socketcand greets", strcmp(can_greet(&daemon), "< hi >") == 0);
    check_true("raw mode", strcmp(said(&daemon, "< open can0 >< rawmode >").answer, "< ok >") == 0 && daemon.attached);
    heard = said(&daemon, "< send 201 2 0 f >");
    check_true("and sends",
               heard.sends && heard.frame.id == 0x201 && !heard.frame.extended && heard.frame.data[1] == 15);
    check_true("without data", said(&daemon, "< send 080 0  >").sends);
    check_true("not what is no frame", !said(&daemon, "< send 201 9 0 >").sends);
    text[can_tell(&daemon, &f, 1500000, text)] = '\0';
    check_true("it is told", strcmp(text, "< frame 181 0.001500 01AB >") == 0);
}

static void mailboxes(void)
{
    struct can_frame f = {.id = 0x123, .count = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}}, sent;
    can_power_on(&c);
    for (uint32_t at = 0x20; at < CAN_BYTES; at += 4) { /* RAM that holds anything */
        can_write(&c, at, at >= 0x220 && at % 32 == 0 ? 0x800081u : at < 0x220 && at % 16 == 0 ? 0x800008u : 0u);
    }
    can_write(&c, 0x230, ~4u); /* AMR of the first: 11 bits */
    can_write(&c, 0x238, ~0u); /* whatever its data */
    can_write(&c, 0x220, 0x8000A8u);
    can_write(&c, 0x14, 1);
    can_write(&c, 0x18, 0x2000); /* while it runs */
    check_true("CONFIG keeps still while it runs", can_read(&c, 0x18) == 0);
    can_received(&c, &f);
    check_true("stored, first byte on top", can_read(&c, 8) == 1 && can_read(&c, 0x228) == 0x01020304u);
    check_true("11 bits at the top", can_read(&c, 0x224) >> 21 == 0x123);
    can_received(&c, &f);
    check_true("the next one is lost", can_read(&c, 0) == (1u << 12 | 1u << 10));
    can_write(&c, 0x220, 1);
    check_true("freed", can_read(&c, 8) == 0);
    f.extended = true;
    can_received(&c, &f);
    check_true("29 bits do not pass the filter", can_read(&c, 8) == 0);
    can_write(&c, 0x24, 0x321u << 21);
    can_write(&c, 0x20, 8u << 16 | 1u);
    check_true("unprotected bits alone change", can_offer(&c, &sent) == 0 && sent.count == 0 && sent.id == 0x321);
    can_write(&c, 0x24, 0);
    check_true("nothing changes under way", can_offer(&c, &sent) == 0 && sent.id == 0x321);
    for (int n = 0; n < 16; n++) {
        can_failed(&c, 0, CAN_BIT_ERROR);
    }
    check_true("passive from 128 on", (can_read(&c, 0x10) >> 16 & 3) == 1);
    can_failed(&c, 0, CAN_ACK_ERROR);
    check_true("not acknowledged, it counts no further", (can_read(&c, 0x10) & 0xFF) == 128);
    for (int n = 0; n < 16; n++) {
        can_failed(&c, 0, CAN_BIT_ERROR);
    }
    check_true("bus-off", (can_read(&c, 0x10) >> 17 & 1) == 1 && can_offer(&c, &sent) < 0 && !can_recovers(&c));
}

int main(void)
{
    const struct can_frame low = {.id = 0x080}, high = {.id = 0x705}, remote = {.id = 0x080, .remote = true};
    check_true("the lower identifier goes first", can_frame_rank(&low) < can_frame_rank(&high));
    check_true("data before what asks for it", can_frame_rank(&low) < can_frame_rank(&remote));
    speakers();
    mailboxes();
    return check_end();
}
