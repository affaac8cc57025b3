/* SPDX-License-Identifier: MIT */
/* The usual outcome of a condition: the compiler lays out that path without a jump, which costs two to four cycles. */
#ifndef LIB_USUALLY_H
#define LIB_USUALLY_H

#define USUALLY(condition) (__builtin_expect((condition) ? 1 : 0, 1) != 0)
#define SELDOM(condition)  (__builtin_expect((condition) ? 1 : 0, 0) != 0)

#endif
