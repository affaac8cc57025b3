/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The timing rules of the Cortex-M3 r2p1, one row each. What is not certain has a lower and an upper count. */
#ifndef TWIN_CYCLES_RULES_H
#define TWIN_CYCLES_RULES_H

#include <stdint.h>

enum cycles_rule {
    RULE_DATA,
    RULE_SKIPPED,
    RULE_MLA,
    RULE_MLA_AFTER_LONG,
    RULE_MLS,
    RULE_LONG_EARLY,
    RULE_LONG_MUL_SHORT_M,
    RULE_LONG_MUL,
    RULE_LONG_MLA_SHORT_M,
    RULE_LONG_MLA,
    RULE_DIVIDE_ZERO,
    RULE_DIVIDE_SMALLER,
    RULE_DIVIDE,
    RULE_LOAD,
    RULE_LOAD_PIPELINED,
    RULE_STORE,
    RULE_STORE_PIPELINED,
    RULE_STORE_REGISTER,
    RULE_STORE_REGISTER_PIPELINED,
    RULE_LOAD_AFTER_STORE,
    RULE_LOAD_AFTER_STORE_ELSEWHERE,
    RULE_MEMORY_AFTER_UPDATING_STORE,
    RULE_DOUBLE,
    RULE_MULTIPLE,
    RULE_TRANSFER,
    RULE_ADDRESS_JUST_COMPUTED,
    RULE_UNALIGNED,
    RULE_BRANCH,
    RULE_BRANCH_NOT_TAKEN,
    RULE_BRANCH_UNKNOWN,
    RULE_COMPARE_BRANCH,
    RULE_COMPARE_BRANCH_UNKNOWN,
    RULE_BRANCH_LR,
    RULE_BRANCH_REGISTER,
    RULE_LOAD_PC,
    RULE_POP_PC,
    RULE_TABLE,
    RULE_TARGET_SPLIT,
    RULE_IT_FOLDED,
    RULE_IT,
    RULE_BARRIER,
    RULE_ISB,
    RULE_EXCEPTION_ENTRY,
    RULE_EXCEPTION_EXIT,
    RULE_TAIL_CHAIN,
    RULES,
};

struct cycles_row {
    const char *name;
    uint8_t low, high;
    const char *source;
};

extern const struct cycles_row cycles_rules[RULES];

#endif
