/* A program on a Cortex-M without an operating system: what it may ask of its board. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* To the debugger, which is QEMU: text, and the bits of numbers. */
void say(const char *text);
void say_number(uint32_t number);
void say_bits(const void *numbers, unsigned bytes);

/* Instructions since the first call, to some tens of them: with -icount shift=0, QEMU's clock moves 1 ns for each, and the
   processor's timer ticks once in 40. */
uint32_t ticks(void);

/* Paint the stack below this function, and afterwards, how much of it was used. */
void paint_stack(void);
uint32_t used_stack(void);

#endif
