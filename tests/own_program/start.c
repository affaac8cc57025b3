/* SPDX-License-Identifier: MIT */
/* The least start-up there is: stack, reset, and a place to stop. In a project of one's own stands that project's. */
#include <stdint.h>

int main(void);
void reset(void);
extern uint32_t stack_top[]; /* program.ld */

static void stop(void)
{
    for (;;) {
    }
}

void reset(void)
{
    (void)main();
    stop();
}

struct vectors {
    uint32_t *stack;
    void (*handler[15])(void);
};

extern const struct vectors vectors;
__attribute__((section(".vectors"), used)) const struct vectors vectors = {
    stack_top, {reset, stop, stop, stop, stop, stop, 0, 0, 0, 0, stop, stop, 0, stop, stop}};
