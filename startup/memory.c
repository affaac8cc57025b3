/* SPDX-License-Identifier: MIT */
/*
 * The four functions that a freestanding compiler may call by itself (GCC manual, "Language Standards"), as C11 7.24
 * defines them, by words where both begin on one. Nothing else of a C library is in the image.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *a, const void *b, size_t size);

typedef uint32_t __attribute__((may_alias)) any_word;

static bool on_words(const void *a, const void *b)
{
    return (((uintptr_t)a | (uintptr_t)b) & (sizeof(any_word) - 1u)) == 0u;
}

void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    for (size_t words = on_words(t, f) ? size / sizeof(any_word) : 0u; words > 0u; words--) {
        *(any_word *)(void *)t = *(const any_word *)(const void *)f;
        t += sizeof(any_word);
        f += sizeof(any_word);
        size -= sizeof(any_word);
    }
    while (size-- > 0u) {
        *t++ = *f++;
    }
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    if ((uintptr_t)t > (uintptr_t)f) {
        while (size-- > 0u) {
            t[size] = f[size];
        }
        return to;
    }
    while (size-- > 0u) {
        *t++ = *f++;
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    unsigned char *t = to;
    const any_word word = (unsigned char)value * 0x01010101u;
    for (size_t words = on_words(t, t) ? size / sizeof(any_word) : 0u; words > 0u; words--) {
        *(any_word *)(void *)t = word;
        t += sizeof(any_word);
        size -= sizeof(any_word);
    }
    while (size-- > 0u) {
        *t++ = (unsigned char)value;
    }
    return to;
}

int memcmp(const void *a, const void *b, size_t size)
{
    const unsigned char *x = a;
    const unsigned char *y = b;
    for (; size > 0u; size--, x++, y++) {
        if (*x != *y) {
            return *x - *y;
        }
    }
    return 0;
}
