/* Start of a program on a Cortex-M with its floating-point unit on, and semihosting. */
#include "board.h"

enum { SYS_WRITE0 = 4, SYS_EXIT = 0x18, STOPPED = 0x20026, FAILED = 0x20023, PAINTED = 0x20000 };
#define PAINT 0xA5A5A5A5u
#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

extern uint32_t data_begin[], data_end[], data_from[], bss_begin[], bss_end[], stack_top[];
int main(void);

static void ask(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void reset(void)
{
    CPACR |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
    for (uint32_t *to = data_begin, *from = data_from; to != data_end;)
        *to++ = *from++;
    for (uint32_t *to = bss_begin; to != bss_end;)
        *to++ = 0;
    SYST_RVR = 0xFFFFFF;
    SYST_CVR = 0;
    SYST_CSR = 5;
    ask(SYS_EXIT, (const void *)(main() ? FAILED : STOPPED));
}

static void fault(void)
{
    say("fault\n");
    ask(SYS_EXIT, (const void *)FAILED);
}

__attribute__((section(".vectors"), used)) static void *const vectors[16]
    = {stack_top, (void *)reset, [2 ... 15] = (void *)fault};

void say(const char *text)
{
    ask(SYS_WRITE0, text);
}

void say_number(uint32_t number)
{
    char text[12], *at = text + sizeof text - 1;
    *at = 0;
    do
        *--at = (char)('0' + number % 10);
    while (number /= 10);
    say(at);
}

void say_bits(const void *numbers, unsigned bytes)
{
    const unsigned char *from = numbers;
    char text[3] = {0, 0, 0};
    for (unsigned b = 0; b < bytes; ++b) {
        text[0] = "0123456789abcdef"[from[b] >> 4];
        text[1] = "0123456789abcdef"[from[b] & 15];
        say(text);
    }
}

uint32_t ticks(void)
{
    return 0xFFFFFF - SYST_CVR;
}

static uint32_t *here(void)
{
    uint32_t *sp;
    __asm__ volatile("mov %0, sp" : "=r"(sp));
    return sp;
}

static uint32_t *painted_from;

__attribute__((noinline)) void paint_stack(void)
{
    painted_from = here() - 16;
    for (uint32_t *at = painted_from - PAINTED; at != painted_from; ++at)
        *(volatile uint32_t *)at = PAINT;
}

__attribute__((noinline)) uint32_t used_stack(void)
{
    uint32_t *at = painted_from - PAINTED;
    while (at != painted_from && *(volatile uint32_t *)at == PAINT)
        ++at;
    return (uint32_t)(painted_from - at + 16) * 4;
}
