/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "socketcand.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REFUSED "\a"

const char *can_greet(struct can_speaker *s)
{
    s->attached = false;
    s->length = 0;
    return s->slcan ? "" : "< hi >";
}

/* ---- socketcand ---- */

static bool parse_send(const char *text, struct can_frame *f)
{
    char *end;
    const char *digits = text;
    unsigned long id = strtoul(text, &end, 16);
    if (end == text || id > 0x1FFFFFFF) {
        return false;
    }
    f->extended = end - digits > 3;
    f->id = (uint32_t)id;
    text = end;
    unsigned long count = strtoul(text, &end, 10);
    if (end == text || count > 8) {
        return false;
    }
    f->count = (uint8_t)count;
    for (unsigned n = 0; n < count; n++) {
        text = end;
        unsigned long byte = strtoul(text, &end, 16);
        if (end == text || byte > 255) {
            return false;
        }
        f->data[n] = (uint8_t)byte;
    }
    while (*end == ' ') {
        end++;
    }
    return *end == '\0';
}

struct can_heard can_obey(struct can_speaker *s, const char *text)
{
    struct can_heard heard = {.answer = "< error unknown command >"};
    if (strncmp(text, "open ", 5) == 0) {
        heard.answer = "< ok >";
    } else if (strncmp(text, "rawmode", 7) == 0) {
        s->attached = true;
        heard.answer = "< ok >";
    } else if (strncmp(text, "echo", 4) == 0) {
        heard.answer = "< echo >";
    } else if (strncmp(text, "send ", 5) == 0) {
        heard.sends = s->attached && parse_send(text + 5, &heard.frame);
        heard.answer = heard.sends ? NULL : "< error not a frame >";
    }
    return heard;
}

const char *can_command(struct can_speaker *s, char c)
{
    if (c == '<') {
        s->length = 0;
    } else if (c == '>' && s->length > 1) {
        s->said[s->length] = '\0';
        s->length = 0;
        return s->said + strspn(s->said, " ");
    } else if (s->length < sizeof s->said - 1) {
        s->said[s->length++] = c;
    }
    return NULL;
}

static struct can_heard hear_command(struct can_speaker *s, char c)
{
    const char *command = can_command(s, c);
    return command ? can_obey(s, command) : (struct can_heard){.answer = NULL};
}

/* ---- slcan ---- */

static bool hexadecimal(const char *text, size_t digits, uint32_t *value)
{
    *value = 0;
    for (size_t n = 0; n < digits; n++) {
        const char *place = text[n] ? strchr("0123456789ABCDEFabcdef", text[n]) : NULL;
        if (!place) {
            return false;
        }
        uint32_t digit = (uint32_t)(place - "0123456789ABCDEFabcdef");
        *value = *value << 4 | (digit > 15 ? digit - 6 : digit);
    }
    return true;
}

bool can_parse(const char *line, struct can_frame *f)
{
    uint32_t byte, count;
    size_t digits = line[0] == 'T' || line[0] == 'R' ? 8 : 3;
    f->extended = digits == 8;
    f->remote = line[0] == 'r' || line[0] == 'R';
    if (!hexadecimal(line + 1, digits, &f->id) || !hexadecimal(line + 1 + digits, 1, &count) || count > 8 ||
        f->id >= (f->extended ? 1u << 29 : 1u << 11)) {
        return false;
    }
    f->count = (uint8_t)count;
    for (unsigned n = 0; n < count && !f->remote; n++) {
        if (!hexadecimal(line + 2 + digits + 2 * n, 2, &byte)) {
            return false;
        }
        f->data[n] = (uint8_t)byte;
    }
    return true;
}

static struct can_heard take_line(struct can_speaker *s, const char *line)
{
    struct can_heard heard = {.answer = REFUSED};
    switch (line[0]) {
    case 't':
    case 'T':
    case 'r':
    case 'R':
        heard.sends = s->attached && can_parse(line, &heard.frame);
        heard.answer = heard.sends ? "\r" : REFUSED;
        break;
    case 'O':
    case 'C':
        s->attached = line[0] == 'O';
        heard.answer = "\r";
        break;
    case 'V':
        heard.answer = "V1013\r";
        break;
    case 'N':
        heard.answer = "N4242\r";
        break;
    case 'F':
        heard.answer = "F00\r";
        break;
    case 'S': /* everybody uses the drive's rate */
    case 's':
    case 'Z':
    case '\0':
        heard.answer = "\r";
        break;
    default:
        break;
    }
    return heard;
}

static struct can_heard hear_line(struct can_speaker *s, char c)
{
    if (c == '\r') {
        s->said[s->length] = '\0';
        s->length = 0;
        return take_line(s, s->said);
    }
    if (c != '\n' && s->length < sizeof s->said - 1) {
        s->said[s->length++] = c;
    }
    return (struct can_heard){.answer = NULL};
}

/* ---- both ---- */

struct can_heard can_hear(struct can_speaker *s, char c)
{
    return s->slcan ? hear_line(s, c) : hear_command(s, c);
}

static size_t print_data(const struct can_frame *f, char *text)
{
    size_t length = 0;
    for (unsigned n = 0; n < f->count && !f->remote; n++) {
        length += (size_t)sprintf(text + length, "%02X", f->data[n]);
    }
    return length;
}

size_t can_print(const struct can_frame *f, char *text)
{
    const char *kind = f->extended ? "TR" : "tr";
    size_t length = (size_t)sprintf(text, "%c%0*X%u", kind[f->remote], f->extended ? 8 : 3, (unsigned)f->id, f->count);
    return length + print_data(f, text + length);
}

/* A remote frame has no place in socketcand's. */
size_t can_tell(const struct can_speaker *s, const struct can_frame *f, int64_t now_ns, char *text)
{
    size_t length;
    if (s->slcan) {
        length = can_print(f, text);
        return length + (size_t)sprintf(text + length, "\r");
    }
    if (f->remote) {
        return 0;
    }
    length = (size_t)sprintf(text, "< frame %0*X %lld.%06lld ", f->extended ? 8 : 3, (unsigned)f->id,
                             (long long)(now_ns / 1000000000), (long long)(now_ns / 1000 % 1000000));
    length += print_data(f, text + length);
    return length + (size_t)sprintf(text + length, " >");
}
