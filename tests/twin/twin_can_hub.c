/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bus that twins and programs share, without sockets: who is told what. */
#include <string.h>

#include "can_hub.h"
#include "check.h"

static struct can_hub hub;
static int64_t now_ms;

/* What has been written to an end since the last look. */
static const char *told(int end)
{
    static char text[CAN_HUB_OUT_BYTES + 1];
    size_t count = hub.ends[end].waiting;
    memcpy(text, hub.ends[end].out, count);
    text[count] = '\0';
    can_hub_written(&hub, end, count, now_ms);
    return text;
}

static void says(int end, const char *text)
{
    can_hub_hear(&hub, end, text, strlen(text), now_ms);
    can_hub_settle(&hub, now_ms);
}

static void is_told(const char *name, int end, const char *expected)
{
    check_true(name, strcmp(told(end), expected) == 0);
}

static int comes(const char *first)
{
    int end = can_hub_join(&hub, now_ms);
    says(end, first);
    return end;
}

static int program(void)
{
    int end = comes("< open can0 >");
    says(end, "< rawmode >");
    now_ms += CAN_HUB_JOIN_MS + 1;
    can_hub_settle(&hub, now_ms);
    (void)told(end);
    return end;
}

static int twin(const char *node)
{
    int end = comes(node);
    (void)told(end);
    return end;
}

static void acknowledges(void)
{
    int a = comes("< node 0 0 >");
    is_told("greeted, and alone", a, "< hi >");
    int b = twin("< node 0 0 >");
    says(a, "< node 2000 0 >");
    is_told("a controller that is off acknowledges nothing", a, "");
    is_told("one that is on does", b, "< others 1 0 >");
    says(b, "< node 2000 0 >");
    is_told("so does a twin that joins", a, "< others 1 0 >");
    can_hub_leave(&hub, b);
    can_hub_settle(&hub, now_ms);
    is_told("until it leaves", a, "< others 0 0 >");
    int p = comes("< open can0 >");
    says(p, "< rawmode >");
    is_told("a program is answered", p, "< hi >< ok >< ok >");
    says(a, "< wire t1231AA 0 >");
    is_told("and told nothing right behind the answer", p, "");
    check_true("but soon", can_hub_waits(&hub));
    now_ms += CAN_HUB_JOIN_MS + 1;
    can_hub_settle(&hub, now_ms);
    check_true("by itself", !can_hub_waits(&hub));
    is_told("then it acknowledges", a, "< others 1 0 >");
    says(p, "< twins >");
    is_told("how many twins there are", p, "< twins 1 >");
    can_hub_leave(&hub, p);
    check_equal("programs are no twins", can_hub_twins(&hub), 1);
    can_hub_leave(&hub, a);
}

static void frames(void)
{
    int a = twin("< node 2000 0 >"), b = twin("< node 2000 0 >"), p = program(), q = program();
    (void)told(a), (void)told(b);
    says(a, "< wire t181201AB 1500000 >");
    is_told("not back to whom it is from", a, "");
    is_told("to the other twin", b, "< wire t181201AB 1500000 >");
    is_told("to programs", p, "< frame 181 0.001500 01AB >");
    is_told("to each of them", q, "< frame 181 0.001500 01AB >");
    says(p, "< send 080 0  >");
    is_told("of a program to every twin", a, "< wire t0800 1500000 >");
    is_told("to this one, too", b, "< wire t0800 1500000 >");
    is_told("and to the other program", q, "< frame 080 0.001500  >");
    is_told("not back", p, "");
    says(b, "< wire R1ABCDEF04 0 >");
    is_told("remote frames, 29 bits", a, "< wire R1ABCDEF04 0 >");
    is_told("for which socketcand has no word", p, "");
    says(p, "< send 201 9 0 >");
    is_told("what is no frame goes nowhere", a, "");
    is_told("and is said to be none", p, "< error not a frame >");
    for (int end = 0; end < 4; end++) {
        can_hub_leave(&hub, end);
    }
}

static void rates(void)
{
    int a = twin("< node 2000 0 >"), b = twin("< node 4000 0 >"), p = program();
    is_told("a twin of another rate destroys", a, "< others 0 1 >< others 1 1 >");
    says(p, "< send 080 0  >");
    is_told("what a program sends, too", a, CAN_LINK_NOISE);
    (void)told(b);
    says(a, CAN_LINK_NOISE);
    is_told("a frame that it has destroyed", b, CAN_LINK_NOISE);
    says(b, "< node 4000 1 >");
    is_told("not if it is error passive", a, "< others 1 0 >");
    says(a, "< wire t1230 0 >");
    is_told("then it hears noise", b, CAN_LINK_NOISE);
    is_told("and others hear the frame", p, "< frame 123 0.000000  >");
    says(b, "< node 2000 0 >");
    (void)told(b);
    says(a, "< wire t1230 0 >");
    is_told("at the same rate it hears", b, "< wire t1230 0 >");
    for (int end = 0; end < 3; end++) {
        can_hub_leave(&hub, end);
    }
}

static void needed(void)
{
    check_true("nobody needs an empty bus", !can_hub_is_needed(&hub));
    int a = twin("< node 2000 0 >"), late = comes("< no");
    can_hub_leave(&hub, a);
    check_true("who has not said what he is may be a twin", can_hub_is_needed(&hub));
    says(late, "de 2000 0 >");
    check_true("as this one is", can_hub_is_needed(&hub) && can_hub_twins(&hub) == 1);
    can_hub_leave(&hub, late);
    int p = comes("");
    check_true("somebody new in its place, too", can_hub_is_needed(&hub));
    says(p, "< twins >");
    check_true("a program does not need it", !can_hub_is_needed(&hub));
    can_hub_leave(&hub, p);
    check_true("nor does who has left", !can_hub_is_needed(&hub));
}

static bool floods(int from, int count, const char *frame)
{
    for (int n = 0; n < count; n++) {
        says(from, frame);
    }
    return true;
}

static void slow(void)
{
    int a = twin("< node 2000 0 >"), b = twin("< node 2000 0 >"), p = program();
    floods(p, 3000, "< send 181 8 1 2 3 4 5 6 7 8 >");
    (void)told(b);
    check_true("a program waits for a twin that has much to take", !can_hub_may_speak(&hub, p, now_ms));
    check_true("a twin does not", can_hub_may_speak(&hub, b, now_ms));
    can_hub_written(&hub, a, 100, now_ms + 900);
    check_true("as long as it takes something", !can_hub_may_speak(&hub, p, now_ms + 1500));
    check_true("not for ever", can_hub_may_speak(&hub, p, now_ms + 2000));
    floods(p, 20000, "< send 181 8 1 2 3 4 5 6 7 8 >");
    (void)told(b);
    says(b, "< node 0 0 >");
    can_hub_leave(&hub, p);
    can_hub_settle(&hub, now_ms);
    const char *text = told(a);
    size_t length = strlen(text);
    check_true("frames that it does not take are lost to it, others are not", length > 200000);
    check_true("who is there is not", strcmp(text + length - strlen("< others 0 0 >"), "< others 0 0 >") == 0);
}

static void room(void)
{
    int count = 0;
    memset(&hub, 0, sizeof hub);
    while (can_hub_join(&hub, 0) >= 0) {
        count++;
    }
    check_equal("as many as there is room for", count, CAN_HUB_ENDS);
}

int main(void)
{
    acknowledges();
    frames();
    rates();
    needed();
    slow();
    room();
    return check_end();
}
