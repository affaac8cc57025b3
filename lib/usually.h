/* SPDX-License-Identifier: MIT */
/* Which way a condition goes nearly always: the compiler lays that way out without a jump, which costs two to four cycles. */
#ifndef LIB_USUALLY_H
#define LIB_USUALLY_H

#define USUALLY(condition) (__builtin_expect((condition) ? 1 : 0, 1) != 0)
#define SELDOM(condition)  (__builtin_expect((condition) ? 1 : 0, 0) != 0)

#endif
